"""The levels of detail of one wall, each a GLB."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError
from walltopo.export.atlas import retexture
from walltopo.export.contract import ExportSettings
from walltopo.export.gltf import Packing, write_glb
from walltopo.export.loose import without_loose
from walltopo.export.meshopt import available
from walltopo.export.picture import encode_picture
from walltopo.export.surface import Look, Surface, mixed_triangles, simplify, split_at_borders
from walltopo.export.wall import Wall
from walltopo.imaging.photo_file import read_rgb

__all__ = ["TIERS", "Tier", "TierBuilder"]

WEB = Packing(quantised=True, compressed=True, normals=False)


@dataclass(frozen=True)
class Tier:
    """One level: its packing and the format of its picture."""

    packing: Packing
    picture: str


TIERS = {
    "first": Tier(WEB, "WEBP"),
    "detail": Tier(WEB, "WEBP"),
    "archive": Tier(Packing(), "JPEG"),
}


class TierBuilder:
    """Makes the tiers of one wall, the coarse from the fine, each at most once.

    A textured wall that is to be simplified gets a new atlas, see `walltopo.export.atlas`. Loose
    pieces of surface are in the archive alone, see `walltopo.export.loose`.
    """

    def __init__(self, wall: Wall, settings: ExportSettings) -> None:
        self.wall = wall
        self.settings = settings
        self._looks: dict[str, Look] = {}

    @cached_property
    def _shown(self) -> Wall:
        return without_loose(self.wall)

    def _full(self, wall: Wall, guessed: NDArray[np.bool_] | None) -> Look:
        picture = None if wall.texture is None else read_rgb(wall.texture)
        surface = split_at_borders(wall.mesh, wall.face_instance, wall.uv, guessed)
        return Look(surface, picture)

    @cached_property
    def _plain(self) -> Surface:
        """The surface split at hold borders alone, so that simplification is free elsewhere."""
        return split_at_borders(self._shown.mesh, self._shown.face_instance)

    def look(self, name: str) -> Look:
        """Surface and picture of a tier.

        Raises
        ------
        StageError : a triangle mixes two ids (a fault of the simplifier, never of the input).
        """
        if name not in self._looks:
            look = self._make(name)
            mixed = mixed_triangles(look.surface)
            if mixed:
                raise StageError(f"export: {mixed} triangles mix two holds after simplification")
            self._looks[name] = look
        return self._looks[name]

    def _make(self, name: str) -> Look:
        triangles = getattr(self.settings, f"{name}_triangles")
        if name == "first":
            finer = self.look("detail")
        elif name == "archive":
            # Programs that read it can tell guesses apart; the page draws them like all else.
            finer = self._full(self.wall, self.wall.mesh.guessed)
        else:
            finer = self._full(self._shown, None)
        if triangles <= 0 or len(finer.surface.triangles) <= triangles or not available():
            return Look(simplify(finer.surface, 0), finer.picture)
        if finer.picture is None:
            return Look(simplify(self._plain, triangles), None)
        # The source's charts would tear: simplify without them, then draw new ones.
        side = getattr(self.settings, f"{name}_texture")
        coarse = simplify(self._plain, triangles)
        new = retexture(coarse, finer, side, oversample=2 if side <= 2048 else 1)
        return Look(simplify(new.surface, 0), new.picture)

    def glb(self, name: str) -> bytes:
        """The GLB of one tier: `first`, `detail` or `archive`."""
        look, tier, settings = self.look(name), TIERS[name], self.settings
        picture = None
        if look.picture is not None:
            longest = getattr(settings, f"{name}_texture")
            picture = encode_picture(look.picture, longest, tier.picture)
        return write_glb(
            look.surface,
            self.wall.holds,
            self.wall.routes,
            picture=picture,
            packing=replace(tier.packing, compressed=tier.packing.compressed and available()),
            metric=self.wall.metric,
            title=self.wall.title,
        )

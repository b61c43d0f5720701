"""The levels of detail of one wall, each a GLB."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError
from walltopo.images.files import read_rgb
from walltopo.publish.atlas import retexture
from walltopo.publish.floaters import Hidden
from walltopo.publish.gltf import Packing, write_glb
from walltopo.publish.kept_tiers import KeptTier, TierShelf
from walltopo.publish.meshopt import available
from walltopo.publish.relabel import relabelled
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import Look, Surface, mixed_triangles, simplify, split_at_borders
from walltopo.publish.texture_image import decode_picture, encode_picture
from walltopo.publish.wall_data import Wall

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

    A textured wall that is to be simplified gets a new atlas, see `walltopo.publish.atlas`. Loose
    pieces and ragged slabs of surface are in the archive alone, see `walltopo.publish.floaters`.

    Parameters
    ----------
    kept : a folder where finished tiers are kept for the next export of this wall; see
        `walltopo.publish.kept_tiers`.
    """

    def __init__(self, wall: Wall, settings: ExportSettings, kept: Path | None = None) -> None:
        self.wall = wall
        self.settings = settings
        self._looks: dict[str, Look] = {}
        self._surfaces: dict[str, Surface] = {}
        self._unlabelled: dict[str, Surface] = {}
        self._pictures: dict[str, Future[tuple[bytes, str] | None]] = {}
        # Encoding takes one core: the next tier is made meanwhile.
        self._encoder = ThreadPoolExecutor(1)
        self._hidden = Hidden(wall, None if kept is None else kept / "thin.npz")
        self._shelf = None if kept is None else TierShelf(kept, wall, settings, self._hidden)

    @cached_property
    def _shown(self) -> Wall:
        return self._hidden.without(self.wall)

    def _full(self, wall: Wall, guessed: NDArray[np.bool_] | None) -> Look:
        picture = None if wall.texture is None else read_rgb(wall.texture)
        surface = split_at_borders(wall.mesh, wall.face_instance, wall.uv, guessed)
        return Look(surface, picture)

    @cached_property
    def _plain(self) -> Surface:
        """The surface split at hold borders alone, so that simplification is free elsewhere."""
        return split_at_borders(self._shown.mesh, self._shown.face_instance)

    def surface(self, name: str) -> Surface:
        """The surface of a tier: as an earlier export made it, with the labels of now, else anew.

        Raises
        ------
        StageError : a triangle mixes two ids (a fault of the simplifier, never of the input).
        """
        if name not in self._surfaces:
            kept = None if self._shelf is None else self._shelf.get(name)
            if kept is None:
                self._looks[name] = self._made(name)
                surface = self._unlabelled[name] = self._looks[name].surface
            else:
                self._pictures[name] = Future()
                self._pictures[name].set_result(kept.picture)
                self._unlabelled[name] = kept.surface
                wall = self.wall
                surface = relabelled(kept.surface, wall.mesh, kept.labels, wall.face_instance)
            mixed = mixed_triangles(surface)
            if mixed:
                raise StageError(f"export: {mixed} triangles mix two holds after simplification")
            self._surfaces[name] = surface
        return self._surfaces[name]

    def look(self, name: str) -> Look:
        """Surface and picture of a tier; see `surface`."""
        surface = self.surface(name)
        if name not in self._looks:
            self._looks[name] = Look(surface, self._decoded(name))
        return self._looks[name]

    def drawn(self, name: str) -> Look:
        """A tier for drawings, in which labels do not matter: the same after every edit."""
        look = self.look(name)
        return replace(look, surface=self._unlabelled[name])

    def _decoded(self, name: str) -> NDArray[np.uint8] | None:
        encoded = self._pictures[name].result()
        return None if encoded is None else decode_picture(encoded[0])

    def _made(self, name: str) -> Look:
        """The tier anew; kept for the next time as soon as its picture is encoded."""
        look = self._make(name)
        self._pictures[name] = self._encoder.submit(self._encoded, name, look)
        return look

    def _encoded(self, name: str, look: Look) -> tuple[bytes, str] | None:
        picture = None
        if look.picture is not None:
            longest = getattr(self.settings, f"{name}_texture")
            picture = encode_picture(look.picture, longest, TIERS[name].picture)
        if self._shelf is not None:
            self._shelf.put(name, KeptTier(look.surface, self.wall.face_instance, picture))
        return picture

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
        surface, tier = self.surface(name), TIERS[name]
        return write_glb(
            surface,
            self.wall.holds,
            self.wall.routes,
            picture=self._pictures[name].result(),
            packing=replace(tier.packing, compressed=tier.packing.compressed and available()),
            metric=self.wall.metric,
            title=self.wall.title,
        )

"""Build the levels of detail of one wall, each a GLB."""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError
from walltopo.publish.atlas import retexture
from walltopo.publish.coarse_wall import CoarseWall, coarse_wall
from walltopo.publish.coverage import count_views
from walltopo.publish.gltf import Packing, write_glb
from walltopo.publish.meshopt import available
from walltopo.publish.settings import ExportSettings
from walltopo.publish.shown import part_shown, shown_faces
from walltopo.publish.surface import (
    Surface,
    TexturedSurface,
    mixed_triangles,
    simplify,
    split_at_borders,
)
from walltopo.publish.texture_image import encode_picture
from walltopo.publish.wall_data import WallModel

WEB = Packing(quantised=True, compressed=True, normals=False)


@dataclass(frozen=True)
class Tier:
    """A level of detail: its packing and the format of its picture."""

    packing: Packing
    picture: str


TIERS = {
    "first": Tier(WEB, "WEBP"),
    "detail": Tier(WEB, "WEBP"),
    "archive": Tier(Packing(), "JPEG"),
}


class TierBuilder:
    """Builds the tiers of one wall, the coarse from the fine, each at most once.

    A textured wall that is simplified gets a new atlas, see `walltopo.publish.atlas`. Surroundings
    are in the archive only, see `walltopo.publish.shown`.
    """

    def __init__(self, wall: WallModel, settings: ExportSettings) -> None:
        self.wall = wall
        self.settings = settings
        self._surfaces: dict[str, TexturedSurface] = {}
        self._coarse: dict[str, Surface] = {}  # simplified, before the texture
        self._pictures: dict[str, Future[tuple[bytes, str] | None]] = {}
        # Encoding uses one core while the next tier is built.
        self._encoder = ThreadPoolExecutor(1)

    @cached_property
    def _coarse_wall(self) -> CoarseWall:
        own = replace(self.wall.mesh)  # its areas and normals are freed
        return coarse_wall(own, self.wall.face_instance)

    @cached_property
    def shown(self) -> NDArray[np.bool_]:
        """Return (F,) the faces that the page shows."""
        return shown_faces(self.wall, self._coarse_wall, all_around=self.settings.surroundings)

    @cached_property
    def _shown(self) -> WallModel:
        return part_shown(self.wall, self.shown)

    @cached_property
    def coverage(self) -> NDArray[np.int32]:
        """Return the (F,) number of photos that see each triangle."""
        if not self.wall.views:
            return np.zeros(len(self.wall.mesh.faces), dtype=np.int32)
        coarse = self._coarse_wall
        return count_views(coarse.mesh, self.wall.views)[coarse.nearest]

    def _full(self, wall: WallModel, guessed: NDArray[np.bool_] | None) -> TexturedSurface:
        surface = split_at_borders(wall.mesh, wall.face_instance, wall.uv, guessed)
        return TexturedSurface(surface, wall.read_texture())

    @cached_property
    def _plain(self) -> Surface:
        """Return the surface split at hold borders only, which leaves simplification free."""
        return split_at_borders(self._shown.mesh, self._shown.face_instance)

    def textured_surface(self, name: str) -> TexturedSurface:
        """Return surface and picture of a tier.

        Raises
        ------
        StageError : a triangle mixes two ids (a defect of the simplifier, never of the input).
        """
        if name not in self._surfaces:
            built = self._surfaces[name] = self._build(name)
            self._pictures[name] = self._encoder.submit(self._encoded, name, built)
            mixed = mixed_triangles(built.surface)
            if mixed:
                raise StageError(f"export: {mixed} triangles mix two holds after simplification")
        return self._surfaces[name]

    def picture(self, name: str) -> tuple[bytes, str] | None:
        """Return the encoded texture of a tier and its MIME type, or None without a texture."""
        self.textured_surface(name)
        return self._pictures[name].result()

    def _encoded(self, name: str, built: TexturedSurface) -> tuple[bytes, str] | None:
        if built.picture is None:
            return None
        longest = getattr(self.settings, f"{name}_texture")
        return encode_picture(built.picture, longest, TIERS[name].picture)

    def _finer(self, name: str) -> TexturedSurface:
        """Return the surface that a tier simplifies."""
        if name == "first":
            return self.textured_surface("detail")
        if name == "archive":
            # Programs can tell guesses apart in the archive; the page draws them like all else.
            return self._full(self.wall, self.wall.mesh.guessed)
        return self._full(self._shown, None)

    def _is_small(self, name: str, triangles: int) -> bool:
        """Return whether the surface that a tier simplifies has at most that many triangles."""
        if name == "first":
            return len(self.textured_surface("detail").surface.triangles) <= triangles
        wall = self.wall if name == "archive" else self._shown
        return len(wall.mesh.faces) <= triangles

    def _build(self, name: str) -> TexturedSurface:
        triangles = getattr(self.settings, f"{name}_triangles")
        if triangles <= 0 or not available() or self._is_small(name, triangles):
            finer = self._finer(name)
            return TexturedSurface(simplify(finer.surface, 0), finer.picture)
        # Simplification would tear the source's charts: simplify without them, then retexture.
        source = self._coarse.get("detail", self._plain) if name == "first" else self._plain
        coarse = self._coarse[name] = simplify(source, triangles)
        if self.wall.texture is None:
            return TexturedSurface(coarse, None)
        side = getattr(self.settings, f"{name}_texture")
        new = retexture(coarse, self._finer(name), side, oversample=2 if side <= 2048 else 1)
        return TexturedSurface(simplify(new.surface, 0), new.picture)

    def glb(self, name: str) -> bytes:
        """Return the GLB of one tier, with its tables: `first`, `detail` or `archive`."""
        return self._written(name, self.wall.title, "")

    def page_glb(self, name: str, labels: str) -> bytes:
        """Return the GLB of a tier without tables, whose labels are in a file beside it."""
        return self._written(name, "Wall", labels)

    def _written(self, name: str, title: str, labels: str) -> bytes:
        surface, tier = self.textured_surface(name).surface, TIERS[name]
        return write_glb(
            surface,
            self.wall.holds,
            self.wall.routes,
            picture=self.picture(name),
            packing=replace(tier.packing, compressed=tier.packing.compressed and available()),
            metric=self.wall.metric,
            title=title,
            labels=labels,
        )

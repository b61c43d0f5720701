"""Square pictures of holds, seen straight from the front: colour and outline."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.rays import Bvh
from walltopo.geometry.similarity import plane_axes
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear
from walltopo.images.files import read_rgb
from walltopo.scans.artifacts import load_bundle, of
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.instances import InstanceTable, Relabelled
from walltopo.scans.pictures import TextureImage, TextureUv

Floats = NDArray[np.float64]

CELLS: Final = 64  # of a patch's side
INSIDE: Final = 3  # the channel behind those of OKLab: 1 on the hold, else 0
_AROUND: Final = 1.5  # half side of a patch, in half sizes of its hold
_MARGIN_M: Final = 0.03
_AWAY_M: Final = 0.6  # from which a hold is looked at


@dataclass(frozen=True, eq=False)
class TexturedWall:
    """The surface of a scan.

    Parameters
    ----------
    mesh : world frame. bvh : of the same mesh.
    labels : (F,) int32, hold id of each triangle, 0 for the wall.
    uv : (F, 3, 2) float32 in [0, 1], origin at the top left. texture : (H, W, 3) uint8 sRGB.
    unit : scan units per metre.
    """

    mesh: Mesh
    bvh: Bvh
    labels: NDArray[np.int32]
    uv: NDArray[np.float32]
    texture: NDArray[np.uint8]
    unit: float


@dataclass(frozen=True)
class SurfaceFiles:
    """The artifacts of a textured surface."""

    mesh: Mesh = of(ScanFolder.mesh)
    texture: TextureImage = of(ScanFolder.texture)
    texture_uv: TextureUv = of(ScanFolder.texture_uv)
    instances: InstanceTable = of(ScanFolder.instances)
    relabelled: Relabelled | None = of(ScanFolder.relabelled)


def read_textured_wall(scan: ScanFolder, unit: float) -> TexturedWall:
    """Return the surface of a scan.

    Parameters
    ----------
    unit : scan units per metre.

    Raises
    ------
    InputError : a file is missing, damaged, or of another run than the others.
    """
    reads = load_bundle(scan, SurfaceFiles)
    mesh = reads.mesh
    reads.instances.check_fits(mesh)
    reads.texture_uv.check_fits(mesh)
    labels = reads.instances.edited_labels(reads.relabelled)
    bvh = Bvh(mesh.vertices, mesh.faces)
    return TexturedWall(mesh, bvh, labels, reads.texture_uv.uv, read_rgb(reads.texture.path), unit)


@dataclass(frozen=True, eq=False)
class Window:
    """The square in which a patch lies, in the plane of the wall.

    Parameters
    ----------
    centre : (3,) world. right, up, normal : (3,) unit. half : half of the side, scan units.
    """

    centre: Floats
    right: Floats
    up: Floats
    normal: Floats
    half: float

    @classmethod
    def around(cls, hold: Hold, unit: float) -> Window:
        """Return the window of a hold."""
        normal = np.array(hold.normal)
        right, up = plane_axes(normal)
        half = _AROUND * hold.size / 2 + _MARGIN_M * unit
        return cls(np.array(hold.position), right, up, normal, half)

    @property
    def cell(self) -> float:
        """Return the side of a cell, scan units."""
        return 2 * self.half / CELLS

    def points(self) -> Floats:
        """Return the (CELLS, CELLS, 3) middles of the cells, from the upper left corner."""
        steps = (np.arange(CELLS) + 0.5) * self.cell - self.half
        across = steps[None, :, None] * self.right
        return np.asarray(self.centre + across - steps[:, None, None] * self.up)


def patch_of(wall: TexturedWall, window: Window, number: int) -> Floats:
    """Return the (CELLS, CELLS, 4) picture of a wall in a window; NaN where nothing is hit.

    Channels: OKLab; 1 on the hold, else 0.

    Parameters
    ----------
    number : the hold's id.
    """
    away = _AWAY_M * wall.unit
    starts = (window.points() + away * window.normal).reshape(-1, 3)
    faces, t = wall.bvh.first_hit(starts, np.broadcast_to(-window.normal, starts.shape))
    patch = np.full((CELLS * CELLS, 4), np.nan)
    hit = np.flatnonzero((faces >= 0) & (t < 2 * away))
    if len(hit):
        places = starts[hit] - t[hit, None] * window.normal
        patch[hit, :INSIDE] = _colours_at(wall, faces[hit], places)
        patch[hit, INSIDE] = wall.labels[faces[hit]] == number
    return patch.reshape(CELLS, CELLS, 4)


def _colours_at(wall: TexturedWall, faces: NDArray[np.int32], places: Floats) -> Floats:
    """Return the (n, 3) OKLab colours of places on triangles."""
    from trimesh.triangles import points_to_barycentric

    corners = wall.mesh.vertices[wall.mesh.faces[faces]]
    shares = points_to_barycentric(corners, places)
    at = np.einsum("nk,nkc->nc", shares, wall.uv[faces].astype(np.float64))
    height, width = wall.texture.shape[:2]
    column = (at[:, 0] * width).astype(int).clip(0, width - 1)
    row = (at[:, 1] * height).astype(int).clip(0, height - 1)
    return oklab_from_linear(linear_from_srgb8(wall.texture[row, column]))

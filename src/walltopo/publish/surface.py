"""The mesh in a renderer's form: one vertex per position, hold and texture coordinate.

A vertex on a hold's border is split: the wall's triangles get their own copy. No triangle then
mixes two ids, and simplification cannot make one that does.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import shared_corners
from walltopo.publish.meshopt import available, simplify_indices

# Weight of an error of the whole texture's width against one of the whole wall's size.
UV_WEIGHT = 0.5
COLOUR_WEIGHT = 0.2


@dataclass(frozen=True, eq=False)
class Surface:
    """Indexed triangles with per-vertex hold ids.

    Parameters
    ----------
    positions : (V, 3) float32, world frame, z up.
    triangles : (T, 3) uint32.
    feature : (V,) int32, hold id, 0 = wall.
    normals : (V, 3) float32, unit, smooth over the unsplit mesh.
    uv : (V, 2) float32 or None.
    colours : (V, 3) uint8 sRGB or None.
    guessed : (V,) uint8, 1 at guessed triangles, or None if unknown.
    """

    positions: NDArray[np.float32]
    triangles: NDArray[np.uint32]
    feature: NDArray[np.int32]
    normals: NDArray[np.float32]
    uv: NDArray[np.float32] | None = None
    colours: NDArray[np.uint8] | None = None
    guessed: NDArray[np.uint8] | None = None

    @cached_property
    def mesh(self) -> Mesh:
        """Return the mesh without attributes."""
        return Mesh(self.positions.astype(np.float64), self.triangles.view(np.int32))


@dataclass(frozen=True, eq=False)
class TexturedSurface:
    """A surface and the (H, W, 3) sRGB picture of its `uv`; None without a texture."""

    surface: Surface
    picture: NDArray[np.uint8] | None


def _smooth_normals(mesh: Mesh) -> NDArray[np.float32]:
    """Return (V, 3) unit normals of vertices, weighted by area; up without any area."""
    normals = np.zeros((len(mesh.vertices), 3), dtype=np.float32)
    _fill_normals(mesh.vertices, mesh.faces, np.zeros((len(normals), 3)), normals)
    return normals


@kernel
def _fill_normals(vertices: Any, faces: Any, total: Any, normals: Any) -> None:
    """Sum the cross products of the triangles' sides at their corners, and normalise."""
    for f in range(len(faces)):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            cross = (vertices[b, i] - vertices[a, i]) * (vertices[c, j] - vertices[a, j])
            cross -= (vertices[b, j] - vertices[a, j]) * (vertices[c, i] - vertices[a, i])
            total[a, k] += cross
            total[b, k] += cross
            total[c, k] += cross
    for v in range(len(normals)):
        length = np.sqrt(total[v, 0] ** 2 + total[v, 1] ** 2 + total[v, 2] ** 2)
        for k in range(3):
            up = 1.0 if k == 2 else 0.0
            normals[v, k] = total[v, k] / length if length > 0.0 else up


def split_at_borders(
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    uv: NDArray[np.float32] | None = None,
    guessed: NDArray[np.bool_] | None = None,
) -> Surface:
    """Return a surface in which each vertex has one hold id and one texture coordinate.

    Parameters
    ----------
    mesh : V vertices, F faces.
    face_instance : (F,) int32, 0 = wall.
    uv : (F, 3, 2) float32 texture coordinates of the corners; equal ones (to 1/65535 of the
        texture) share a vertex.
    guessed : (F,) bool; if given, guessed and measured triangles share no vertex.
    """
    ids = face_instance.astype(np.uint64)
    if guessed is not None:
        ids = 2 * ids + guessed
    values = np.empty(mesh.faces.shape, dtype=np.uint64)
    values[:] = ids[:, None] << np.uint64(32)
    if uv is not None:
        for k in range(3):  # by corner, to bound the memory
            u, v = np.rint(np.clip(uv[:, k], 0.0, 1.0) * 65535.0).astype(np.uint32).T
            values[:, k] |= (u << np.uint32(16)) | v
    first, triangles = shared_corners(mesh.faces, values, len(mesh.vertices))
    del values, ids
    source = mesh.faces.ravel()[first]
    colours = mesh.vertex_colours
    return Surface(
        positions=mesh.vertices[source].astype(np.float32),
        triangles=triangles,
        feature=face_instance[first // 3].astype(np.int32),
        normals=_smooth_normals(mesh)[source],
        uv=None if uv is None else uv.reshape(-1, 2)[first].astype(np.float32),
        colours=None if colours is None or uv is not None else colours[source],
        guessed=None if guessed is None else guessed[first // 3].astype(np.uint8),
    )


def same_places(positions: NDArray[np.float32]) -> NDArray[np.int64]:
    """Return the (V,) number of each vertex's position; equal positions have equal numbers."""
    # Adding zero turns -0.0 into 0.0, whose bits differ.
    bits = (positions + np.float32(0.0)).view(np.uint32).astype(np.uint64)
    _, number = np.unique((bits[:, 0] << np.uint64(32)) | bits[:, 1], return_inverse=True)
    key = (number.astype(np.uint64) << np.uint64(32)) | bits[:, 2]
    return np.asarray(np.unique(key, return_inverse=True)[1])


def mixed_triangles(surface: Surface) -> int:
    """Return the number of triangles with vertices of two ids; a valid surface has 0."""
    ids = surface.feature[surface.triangles]
    return int(np.count_nonzero((ids != ids[:, :1]).any(axis=1)))


def _simplification_attributes(surface: Surface) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Return the attributes that simplification preserves, and the weight of each column."""
    if surface.uv is not None:
        return surface.uv, np.full(2, UV_WEIGHT, np.float32)
    if surface.colours is not None:
        return (surface.colours / np.float32(255)).astype(np.float32), np.full(
            3, COLOUR_WEIGHT, np.float32
        )
    return surface.normals, np.full(3, 0.02, np.float32)


def simplify(surface: Surface, triangles: int) -> Surface:
    """Return a surface of about `triangles`, by edge collapse along, never across, hold borders.

    meshoptimizer's attribute-aware simplifier treats split vertices at one position as a seam, and
    moves both sides of a seam together, so that no cracks open. Without meshoptimizer the surface
    is returned unchanged (the stage `export` notes this).
    """
    if not available():
        return surface
    if triangles <= 0 or len(surface.triangles) <= triangles:
        return _reorder_surface(surface, surface.triangles)
    values, weights = _simplification_attributes(surface)
    kept = simplify_indices(surface.triangles, surface.positions, values, weights, triangles)
    return _reorder_surface(surface, kept)


def _reorder_surface(surface: Surface, triangles: NDArray[np.uint32]) -> Surface:
    """Drop unused vertices; order vertices and triangles for the GPU's caches and the codec."""
    import meshoptimizer

    count = len(surface.positions)
    indices = np.ascontiguousarray(triangles, dtype=np.uint32).ravel()
    cached = np.zeros_like(indices)
    meshoptimizer.optimize_vertex_cache(cached, indices, len(indices), count)
    remap = np.zeros(count, dtype=np.uint32)
    used = meshoptimizer.optimize_vertex_fetch_remap(remap, cached, len(cached), count)
    kept = np.flatnonzero(remap != np.uint32(0xFFFFFFFF))
    order = np.zeros(used, dtype=np.int64)
    order[remap[kept]] = kept
    return Surface(
        positions=surface.positions[order],
        triangles=remap[cached].reshape(-1, 3).astype(np.uint32),
        feature=surface.feature[order],
        normals=surface.normals[order],
        uv=None if surface.uv is None else surface.uv[order],
        colours=None if surface.colours is None else surface.colours[order],
        guessed=None if surface.guessed is None else surface.guessed[order],
    )

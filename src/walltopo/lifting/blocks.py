"""A mesh prepared for many views: triangles grouped into small cubes that are culled together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.kernels import in_ranges, kernel

__all__ = ["Blocks", "blocks_of"]

Floats = NDArray[np.float64]

FACES_PER_BLOCK = 128
MOST_CELLS = 1 << 22


@dataclass(frozen=True, eq=False)
class Blocks:
    """Triangles of a mesh in the order of the cubes of a grid.

    Parameters
    ----------
    vertices : (V, 3) float64, world frame, in block order; those that several blocks use are
        repeated, so that each block's lie together.
    faces : (F, 3) int32, indices into `vertices`, in block order.
    original : (F,) int32, the mesh's face index of each.
    centroids : (F, 3) float64; areas, longest (edge) : (F,) float64; all in block order.
    starts, vertex_starts : (B + 1,) int64, where each block's faces and vertices begin.
    spheres : (B, 4) float64, centre and radius of a ball around each block.
    """

    vertices: Floats
    faces: NDArray[np.int32]
    original: NDArray[np.int32]
    centroids: Floats
    areas: Floats
    longest: Floats
    starts: NDArray[np.int64]
    vertex_starts: NDArray[np.int64]
    spheres: Floats


def blocks_of(mesh: Mesh) -> Blocks:
    """Group the triangles of a mesh; triangles without area are left out (nothing sees them)."""
    count = len(mesh.faces)
    centroids, areas, longest = np.zeros((count, 3)), np.zeros(count), np.zeros(count)
    in_ranges(_measure, count, mesh.vertices, mesh.faces, centroids, areas, longest)
    low, high = centroids.min(axis=0), centroids.max(axis=0)
    # Surfaces fill few cells of a grid: its cell is sized by area, not by volume.
    side = np.sqrt(areas.sum() * FACES_PER_BLOCK / len(areas))
    extent = np.maximum(high - low, 1e-300)
    side = max(side, float(np.cbrt(np.prod(np.maximum(extent, side)) / MOST_CELLS)), 1e-300)
    shape = np.floor(extent / side).astype(np.int64) + 1
    if np.prod(shape.astype(np.float64)) > 2 * MOST_CELLS:  # a few far outliers
        side = float(extent.max()) / np.cbrt(MOST_CELLS)
        shape = np.floor(extent / side).astype(np.int64) + 1
    cells = np.full(count, -1, dtype=np.int32)
    in_ranges(_cells, count, centroids, areas, low, side, shape, cells)
    order, starts = _counting_sort(cells, int(np.prod(shape)))
    faces = mesh.faces[order]
    centroids, areas, longest = centroids[order], areas[order], longest[order]
    blocks = len(starts) - 1
    vertex_starts = np.zeros(len(starts), dtype=np.int64)
    in_ranges(_count_vertices, blocks, faces, starts, len(mesh.vertices), vertex_starts[1:])
    np.cumsum(vertex_starts, out=vertex_starts)
    vertices = np.zeros((vertex_starts[-1], 3))
    in_ranges(_gather_vertices, blocks, mesh.vertices, faces, starts, vertex_starts, vertices)
    spheres = _spheres(vertices, vertex_starts)
    return Blocks(vertices, faces, order, centroids, areas, longest, starts, vertex_starts, spheres)


@kernel
def _measure(
    begin: Any, end: Any, vertices: Any, faces: Any, centroids: Any, areas: Any, longest: Any
) -> None:
    for f in range(begin, end):
        a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
        ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
        bx, by, bz = vertices[b, 0], vertices[b, 1], vertices[b, 2]
        cx, cy, cz = vertices[c, 0], vertices[c, 1], vertices[c, 2]
        centroids[f, 0] = (ax + bx + cx) / 3.0
        centroids[f, 1] = (ay + by + cy) / 3.0
        centroids[f, 2] = (az + bz + cz) / 3.0
        ux, uy, uz = bx - ax, by - ay, bz - az
        vx, vy, vz = cx - ax, cy - ay, cz - az
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        areas[f] = 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)
        wx, wy, wz = cx - bx, cy - by, cz - bz
        square = max(ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz)
        longest[f] = np.sqrt(max(square, wx * wx + wy * wy + wz * wz))


@kernel
def _cells(
    begin: Any, end: Any, centroids: Any, areas: Any, low: Any, side: Any, shape: Any, cells: Any
) -> None:
    for f in range(begin, end):
        if areas[f] > 0:
            cell = 0
            for axis in range(3):
                k = int((centroids[f, axis] - low[axis]) / side)
                cell = cell * shape[axis] + min(max(k, 0), shape[axis] - 1)
            cells[f] = cell


@kernel
def _counting_sort(cells: Any, count: Any) -> Any:
    """Indices grouped by cell (cell -1 left out), and the starts of the non-empty cells."""
    places = np.zeros(count + 1, dtype=np.int64)
    for f in range(len(cells)):
        if cells[f] >= 0:
            places[cells[f] + 1] += 1
    filled = 0
    for cell in range(count):
        filled += places[cell + 1] > 0
    starts = np.zeros(filled + 1, dtype=np.int64)
    filled = 0
    for cell in range(count):
        if places[cell + 1] > 0:
            filled += 1
            starts[filled] = starts[filled - 1] + places[cell + 1]
        places[cell + 1] += places[cell]
    order = np.zeros(places[count], dtype=np.int32)
    for f in range(len(cells)):
        if cells[f] >= 0:
            order[places[cells[f]]] = f
            places[cells[f]] += 1
    return order, starts


@kernel
def _count_vertices(begin: Any, end: Any, faces: Any, starts: Any, total: Any, counts: Any) -> None:
    """How many different vertices each block has."""
    met = np.full(total, -1, dtype=np.int32)
    for b in range(begin, end):
        for f in range(starts[b], starts[b + 1]):
            for corner in range(3):
                if met[faces[f, corner]] != b:
                    met[faces[f, corner]] = b
                    counts[b] += 1


@kernel
def _gather_vertices(
    begin_block: Any, end_block: Any, vertices: Any, faces: Any, starts: Any, vertex_starts: Any,
    gathered: Any,
) -> None:  # fmt: skip
    """Vertices block by block; `faces` is changed to point at them."""
    place = np.full(len(vertices), -1, dtype=np.int32)
    for b in range(begin_block, end_block):
        begin, end = vertex_starts[b], vertex_starts[b]
        for f in range(starts[b], starts[b + 1]):
            for corner in range(3):
                vertex = faces[f, corner]
                # Blocks are filled in order: a place before this block's is an older one's.
                if place[vertex] < begin:
                    place[vertex] = end
                    for axis in range(3):
                        gathered[end, axis] = vertices[vertex, axis]
                    end += 1
                faces[f, corner] = place[vertex]


def _spheres(vertices: Floats, starts: NDArray[np.int64]) -> Floats:
    """(B, 4) centre and radius of a ball around each block's vertices."""
    low = np.minimum.reduceat(vertices, starts[:-1], axis=0)
    high = np.maximum.reduceat(vertices, starts[:-1], axis=0)
    radius = np.sqrt(((high - low) ** 2).sum(axis=1)) / 2
    return np.column_stack([(low + high) / 2, radius])

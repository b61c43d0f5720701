"""A mesh prepared for many views: triangles grouped into blocks that are culled together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import in_ranges, kernel

Floats = NDArray[np.float64]

FACES_PER_BLOCK = 128
MAX_CELLS = 1 << 22


@dataclass(frozen=True, eq=False)
class Blocks:
    """The triangles of a mesh, ordered by the cell of a grid that contains them.

    Parameters
    ----------
    vertices : (V, 3) float64, world frame, in block order. A vertex of several blocks is repeated,
        so that the vertices of each block are contiguous.
    faces : (F, 3) int32, indices into `vertices`, in block order.
    original : (F,) int32, index of each face in the mesh.
    centroids : (F, 3) float64; areas, longest (edge) : (F,) float64; all in block order.
    starts, vertex_starts : (B + 1,) int64, first face and first vertex of each block.
    spheres : (B, 4) float64, centre and radius of a bounding sphere of each block.
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
    """Return the triangles of a mesh in blocks, without degenerate ones (no view sees them)."""
    count = len(mesh.faces)
    middles, areas = np.zeros((count, 3)), np.zeros(count)
    in_ranges(_middles, count, mesh.vertices, mesh.faces, middles, areas)
    cells, grid = _in_grid(middles, areas)
    order, starts = _counting_sort(cells, grid)
    blocks = len(starts) - 1
    vertex_starts = np.zeros(len(starts), dtype=np.int64)
    used = len(mesh.vertices)
    in_ranges(_count_vertices, blocks, mesh.faces, order, starts, used, vertex_starts[1:])
    np.cumsum(vertex_starts, out=vertex_starts)
    vertices, spheres = np.zeros((vertex_starts[-1], 3)), np.zeros((blocks, 4))
    faces, centroids = np.zeros((len(order), 3), dtype=np.int32), np.zeros((len(order), 3))
    areas, longest = np.zeros(len(order)), np.zeros(len(order))
    in_ranges(
        _gather,
        blocks,
        mesh.vertices,
        mesh.faces,
        order,
        starts,
        vertex_starts,
        vertices,
        faces,
        spheres,
    )
    in_ranges(_measure, len(order), vertices, faces, centroids, areas, longest)
    return Blocks(vertices, faces, order, centroids, areas, longest, starts, vertex_starts, spheres)


def _in_grid(middles: Floats, areas: Floats) -> tuple[NDArray[np.int32], int]:
    """Return the (F,) grid cell of each triangle, -1 = degenerate, and the number of cells."""
    low, high = middles.min(axis=0), middles.max(axis=0)
    # Surfaces fill few cells of a grid, so the cell size follows from area, not from volume.
    side = np.sqrt(areas.sum() * FACES_PER_BLOCK / len(areas))
    extent = np.maximum(high - low, 1e-300)
    side = max(side, float(np.cbrt(np.prod(np.maximum(extent, side)) / MAX_CELLS)), 1e-300)
    shape = np.floor(extent / side).astype(np.int64) + 1
    if np.prod(shape.astype(np.float64)) > 2 * MAX_CELLS:  # the mesh has a few far outliers
        side = float(extent.max()) / np.cbrt(MAX_CELLS)
        shape = np.floor(extent / side).astype(np.int64) + 1
    cells = np.full(len(areas), -1, dtype=np.int32)
    in_ranges(_cells, len(areas), middles, areas, low, side, shape, cells)
    return cells, int(np.prod(shape))


@kernel
def _corners(vertices: Any, faces: Any, f: Any) -> Any:
    a, b, c = faces[f, 0], faces[f, 1], faces[f, 2]
    ax, ay, az = vertices[a, 0], vertices[a, 1], vertices[a, 2]
    bx, by, bz = vertices[b, 0], vertices[b, 1], vertices[b, 2]
    cx, cy, cz = vertices[c, 0], vertices[c, 1], vertices[c, 2]
    return ax, ay, az, bx, by, bz, cx, cy, cz


@kernel
def _area(ax: Any, ay: Any, az: Any, bx: Any, by: Any, bz: Any, cx: Any, cy: Any, cz: Any) -> Any:
    ux, uy, uz = bx - ax, by - ay, bz - az
    vx, vy, vz = cx - ax, cy - ay, cz - az
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    return 0.5 * np.sqrt(nx * nx + ny * ny + nz * nz)


@kernel
def _middles(begin: Any, end: Any, vertices: Any, faces: Any, middles: Any, areas: Any) -> None:
    for f in range(begin, end):
        ax, ay, az, bx, by, bz, cx, cy, cz = _corners(vertices, faces, f)
        middles[f, 0] = (ax + bx + cx) / 3.0
        middles[f, 1] = (ay + by + cy) / 3.0
        middles[f, 2] = (az + bz + cz) / 3.0
        areas[f] = _area(ax, ay, az, bx, by, bz, cx, cy, cz)


@kernel
def _measure(
    begin: Any, end: Any, vertices: Any, faces: Any, centroids: Any, areas: Any, longest: Any
) -> None:
    _middles(begin, end, vertices, faces, centroids, areas)
    for f in range(begin, end):
        ax, ay, az, bx, by, bz, cx, cy, cz = _corners(vertices, faces, f)
        ux, uy, uz = bx - ax, by - ay, bz - az
        vx, vy, vz = cx - ax, cy - ay, cz - az
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
    """Return face indices grouped by cell (without cell -1), and the starts of non-empty cells."""
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
def _count_vertices(
    begin: Any, end: Any, faces: Any, order: Any, starts: Any, total: Any, counts: Any
) -> None:
    """Count the distinct vertices of each block."""
    met = np.full(total, -1, dtype=np.int32)
    for b in range(begin, end):
        for f in range(starts[b], starts[b + 1]):
            for corner in range(3):
                vertex = faces[order[f], corner]
                if met[vertex] != b:
                    met[vertex] = b
                    counts[b] += 1


@kernel
def _gather(
    begin_block: Any,
    end_block: Any,
    vertices: Any,
    faces: Any,
    order: Any,
    starts: Any,
    vertex_starts: Any,
    gathered: Any,
    own: Any,
    spheres: Any,
) -> None:
    """Write the vertices block by block, faces that index them, and bounding spheres."""
    place = np.full(len(vertices), -1, dtype=np.int32)
    for b in range(begin_block, end_block):
        begin, end = vertex_starts[b], vertex_starts[b]
        for f in range(starts[b], starts[b + 1]):
            for corner in range(3):
                vertex = faces[order[f], corner]
                # Blocks are filled in order: an index below `begin` belongs to an earlier block.
                if place[vertex] < begin:
                    place[vertex] = end
                    for axis in range(3):
                        gathered[end, axis] = vertices[vertex, axis]
                    end += 1
                own[f, corner] = place[vertex]
        square = 0.0
        for axis in range(3):
            low, high = gathered[begin, axis], gathered[begin, axis]
            for k in range(begin + 1, end):
                low, high = min(low, gathered[k, axis]), max(high, gathered[k, axis])
            spheres[b, axis] = (low + high) / 2
            square += (high - low) ** 2
        spheres[b, 3] = np.sqrt(square) / 2

"""Extract a surface from a sparse volume by marching cubes, manifold by construction.

Lorensen and Cline, "Marching cubes", 1987, with a table derived here. On every face of a cube the
corners outside the surface are kept apart. So two cubes always agree on their common face, and
the surface has no holes (the flaw of the classic table).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import kernel
from walltopo.reconstruct.dense.tsdf import BLOCK, Volume

Singles = NDArray[np.float32]

# Corner n of a cube lies at (n & 1, n >> 1 & 1, n >> 2 & 1).
_EDGES = [(a, a | bit) for bit in (1, 2, 4) for a in range(8) if not a & bit]
_EDGE_INDEX = {frozenset(edge): number for number, edge in enumerate(_EDGES)}
# The corners of each face, counter-clockwise seen from outside the cube.
_FACES = [
    (0, 4, 6, 2),
    (1, 3, 7, 5),
    (0, 1, 5, 4),
    (2, 6, 7, 3),
    (0, 2, 3, 1),
    (4, 5, 7, 6),
]
_MAX_TRIANGLES = 5


def _face_segments(face: tuple[int, ...], inside: int) -> list[tuple[int, int]]:
    """Return the directed segments of the surface on one face of a cube, as pairs of edge numbers.

    Each segment keeps one run of inside corners on its left, seen from outside the cube.
    """
    flags = [bool(inside >> corner & 1) for corner in face]
    segments: list[tuple[int, int]] = []
    for k in range(4):
        if flags[k] or not flags[k - 1]:
            continue
        # A run of inside corners ends before k; find the start of the next run.
        step = k
        while not flags[step % 4]:
            step += 1
        end = _EDGE_INDEX[frozenset((face[k - 1], face[k]))]
        begin = _EDGE_INDEX[frozenset((face[(step - 1) % 4], face[step % 4]))]
        segments.append((end, begin))
    return segments


def _crossing_loops(inside: int) -> list[list[int]]:
    """Return the closed chains of edge crossings of one configuration."""
    follow: dict[int, int] = {}
    for face in _FACES:
        for start, stop in _face_segments(face, inside):
            follow[start] = stop
    loops: list[list[int]] = []
    while follow:
        first, current = follow.popitem()
        loop = [first]
        while current != first:
            loop.append(current)
            current = follow.pop(current)
        loops.append(loop)
    return loops


def _on_one_face(a: int, b: int) -> bool:
    """Return whether two edges of the cube lie on a common face."""
    corners = {*_EDGES[a], *_EDGES[b]}
    return any(corners <= set(face) for face in _FACES)


def _triangulate(loop: list[int]) -> list[tuple[int, int, int]] | None:
    """Return the triangles of a loop such that no inner edge lies on a face of the cube.

    Such an edge could coincide with an edge of the neighbouring cube and break manifoldness.
    """
    if len(loop) == 3:
        return [(loop[0], loop[1], loop[2])]
    for k in range(len(loop)):
        a, b, c = loop[k - 1], loop[k], loop[(k + 1) % len(loop)]
        if not _on_one_face(a, c):
            rest = _triangulate([e for e in loop if e != b])
            if rest is not None:
                return [(a, b, c), *rest]
    return None


@cache
def cube_table() -> NDArray[np.int8]:
    """Return the triangle edges per configuration of inside corners, (256, 15) int8, -1 = end."""
    table = np.full((256, 3 * _MAX_TRIANGLES), -1, dtype=np.int8)
    for inside in range(256):
        triangles: list[int] = []
        for loop in _crossing_loops(inside):
            found = _triangulate(loop)
            if found is None:
                raise AssertionError(f"cube {inside}: no triangulation")
            triangles += [edge for triangle in found for edge in triangle]
        table[inside, : len(triangles)] = triangles
    return table


@kernel
def _fill_corners(
    distance: Singles,
    weight: Singles,
    grid: NDArray[np.int32],
    block: NDArray[np.int64],
    min_weight: float,
    values: Singles,
) -> None:
    """Fill the values at the (BLOCK + 1)^3 corners of a block's cubes, NaN if unobserved."""
    size = distance.shape[1]
    for i in range(size + 1):
        for j in range(size + 1):
            for k in range(size + 1):
                bi, bj, bk = block[0] + i // size, block[1] + j // size, block[2] + k // size
                values[i, j, k] = np.nan
                if bi >= grid.shape[0] or bj >= grid.shape[1] or bk >= grid.shape[2]:
                    continue
                b = grid[bi, bj, bk]
                if b >= 0 and weight[b, i % size, j % size, k % size] >= min_weight:
                    value = distance[b, i % size, j % size, k % size]
                    # A corner exactly on the surface would give a triangle of zero area.
                    values[i, j, k] = (
                        value if abs(value) > 1e-3 else (1e-3 if value >= 0 else -1e-3)
                    )


@kernel
def _march(
    distance: Singles,
    weight: Singles,
    grid: NDArray[np.int32],
    blocks: NDArray[np.int64],
    min_weight: float,
    table: NDArray[np.int8],
    edges: NDArray[np.int64],
    strides: NDArray[np.int64],
) -> tuple[NDArray[np.int64], Singles]:
    """Return triangle corners as edge keys, and the position (0 .. 1) of each along its edge."""
    size = distance.shape[1]
    capacity = 1 << 16
    keys = np.empty(capacity, np.int64)
    fraction = np.empty(capacity, np.float32)
    count = 0
    values = np.empty((size + 1, size + 1, size + 1), np.float32)
    for b in range(len(blocks)):
        _fill_corners(distance, weight, grid, blocks[b], min_weight, values)
        for i in range(size):
            for j in range(size):
                for k in range(size):
                    inside = 0
                    known = True
                    for n in range(8):
                        value = values[i + (n & 1), j + (n >> 1 & 1), k + (n >> 2 & 1)]
                        if np.isnan(value):
                            known = False
                            break
                        if value < 0:
                            inside |= 1 << n
                    if not known or inside == 0 or inside == 255:
                        continue
                    for t in range(table.shape[1]):
                        edge = table[inside, t]
                        if edge < 0:
                            break
                        a, c = edges[edge, 0], edges[edge, 1]
                        ai, aj, ak = i + (a & 1), j + (a >> 1 & 1), k + (a >> 2 & 1)
                        va = values[ai, aj, ak]
                        vc = values[i + (c & 1), j + (c >> 1 & 1), k + (c >> 2 & 1)]
                        corner = (
                            (blocks[b, 0] * size + ai) * strides[0]
                            + (blocks[b, 1] * size + aj) * strides[1]
                            + (blocks[b, 2] * size + ak)
                        )
                        if count == capacity:
                            capacity *= 2
                            new_keys = np.empty(capacity, np.int64)
                            new_fractions = np.empty(capacity, np.float32)
                            for n in range(count):
                                new_keys[n], new_fractions[n] = keys[n], fraction[n]
                            keys, fraction = new_keys, new_fractions
                        keys[count] = corner * 3 + edges[edge, 2]
                        fraction[count] = va / (va - vc)
                        count += 1
    return keys[:count], fraction[:count]


def extract(volumes: Iterable[Volume], min_weight: float) -> Mesh:
    """Return the zero surface of volumes, wound counter-clockwise seen from the cameras.

    Parameters
    ----------
    volumes : fused distances, one or more parts of a space; only one part is in memory at a time.
    min_weight : voxels that were observed less than this bound no triangle.
    """
    parts = []
    for volume in volumes:
        origin, voxel, grid = volume.origin, volume.voxel, volume.grid.shape
        parts.append(_part_of(volume, min_weight))
        del volume
    # Parts that meet on a grid edge use the same key for the edge, so they share its vertex.
    keys, first, number = np.unique(
        np.concatenate([part.keys for part in parts]), return_index=True, return_inverse=True
    )
    borders = np.cumsum([len(part.keys) for part in parts])[:-1]
    of_part = np.split(number.astype(np.int32), borders)
    faces = [own[part.faces] for own, part in zip(of_part, parts, strict=True)]
    fraction = np.concatenate([part.fraction for part in parts])[first]
    del parts
    corner, axis = keys // 3, keys % 3
    strides = _strides(grid)
    x, rest = np.divmod(corner, strides[0])
    y, z = np.divmod(rest, strides[1])
    position = np.stack([x, y, z], axis=1).astype(np.float64)
    position[np.arange(len(axis)), axis] += fraction
    return Mesh(origin + voxel * position, np.concatenate(faces)[:, ::-1])


@dataclass(frozen=True, eq=False)
class _Part:
    """The surface in one volume.

    Parameters
    ----------
    keys : (N,) int64, ascending, grid edge of each vertex.
    fraction : (N,) float32, place of the vertex along the edge, 0 to 1.
    faces : (F, 3) int32.
    """

    keys: NDArray[np.int64]
    fraction: Singles
    faces: NDArray[np.int32]


def _part_of(volume: Volume, min_weight: float) -> _Part:
    """Return the zero surface of one volume."""
    keys, fraction = _march(
        volume.distance,
        volume.weight,
        volume.grid,
        volume.blocks[: volume.own].astype(np.int64),
        np.float32(min_weight),
        cube_table(),
        np.array([(a, c, int(a ^ c).bit_length() - 1) for a, c in _EDGES], dtype=np.int64),
        _strides(volume.grid.shape),
    )
    unique, first, number = np.unique(keys, return_index=True, return_inverse=True)
    return _Part(unique, fraction[first], number.reshape(-1, 3).astype(np.int32))


def _strides(grid: tuple[int, ...]) -> NDArray[np.int64]:
    """Return the steps of a grid corner's number along x and y, for blocks of a `grid` shape."""
    counts = np.array(grid, dtype=np.int64) * BLOCK + 1
    return np.array([counts[1] * counts[2], counts[2]], dtype=np.int64)

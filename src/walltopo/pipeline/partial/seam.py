"""Find the seam of a partial rescan: the lines along which old surface meets new surface."""

from __future__ import annotations

from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import boundary_loops, edges_of, fans

Floats = NDArray[np.float64]
Flags = NDArray[np.bool_]

TOLERANCE: Final = 0.01  # metres by which a line may leave the edges of the triangles
MIN_LENGTH: Final = 0.10  # metres; shorter lines surround single triangles


def seam_lines(mesh: Mesh, stays: Flags, unit: float = 1.0) -> list[Floats]:
    """Return the lines between replaced triangles and triangles that stay.

    The border of the mesh itself is no seam.

    Parameters
    ----------
    mesh : the old mesh; stays : (F,) bool; unit : scan units per metre.

    Returns
    -------
    (n, 3) points of each line, n >= 2; a closed line ends at its first point.
    """
    replaced = mesh.faces[~stays]
    # Only in a vertex-manifold mesh has each border vertex one successor.
    corner = fans(replaced)
    vertex = np.zeros(int(corner.max(initial=-1)) + 1, dtype=np.int64)
    vertex[corner.ravel()] = replaced.ravel()
    first, second = edges_of(mesh.faces[stays]).pairs.T
    kept = _edge_keys(first, second, len(mesh.vertices))
    lines = []
    for loop in boundary_loops(corner):
        corners = vertex[loop]
        keys = _edge_keys(corners, np.roll(corners, -1), len(mesh.vertices))
        lines += [mesh.vertices[run] for run in _runs(corners, np.isin(keys, kept))]
    return [
        simplified(line, TOLERANCE * unit) for line in lines if _length(line) >= MIN_LENGTH * unit
    ]


def _edge_keys(
    first: NDArray[np.integer], second: NDArray[np.integer], count: int
) -> NDArray[np.int64]:
    """Return one number for each undirected edge between two of `count` vertices."""
    return np.minimum(first, second).astype(np.int64) * count + np.maximum(first, second)


def _runs(corners: NDArray[np.int64], chosen: Flags) -> list[NDArray[np.int64]]:
    """Return the chains of chosen edges of a loop; edge k leads from corner k to the next one."""
    closed = np.append(corners, corners[0])
    if chosen.all():
        return [closed]
    # Start behind an edge that is not chosen, so that no chain spans the start.
    first = int(np.flatnonzero(~chosen)[0]) + 1
    corners, chosen = np.roll(corners, -first), np.roll(chosen, -first)
    steps = np.diff(np.concatenate([[False], chosen, [False]]).astype(np.int8))
    starts, stops = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1)
    # The last edge is not chosen, so `stop` is always a corner.
    return [corners[a : b + 1] for a, b in zip(starts, stops, strict=True)]


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def simplified(line: Floats, tolerance: float) -> Floats:
    """Return a line with fewer of its points, from which no point is farther than `tolerance`.

    The algorithm is by Douglas and Peucker; a closed line is first split at its farthest point.
    """
    keep = np.zeros(len(line), dtype=np.bool_)
    keep[[0, -1]] = True
    pieces = [(0, len(line) - 1)]
    while pieces:
        first, last = pieces.pop()
        if last - first < 2:
            continue
        away = _distances(line[first + 1 : last], line[first], line[last])
        farthest = int(away.argmax())
        if away[farthest] > tolerance:
            middle = first + 1 + farthest
            keep[middle] = True
            pieces += [(first, middle), (middle, last)]
    return line[keep]


def _distances(points: Floats, start: Floats, end: Floats) -> Floats:
    """Return the distance of each point from a segment."""
    along = end - start
    square = float(along @ along)
    if square == 0:
        share = np.zeros(len(points))
    else:
        share = np.clip((points - start) @ along / square, 0, 1)
    return np.asarray(np.linalg.norm(points - start - share[:, None] * along, axis=1))

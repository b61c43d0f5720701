"""Where a mesh is open and may be closed: holes, and bays of its border."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.borders import boundary_loops
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import Edges, vertex_parts

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

# Mean cosine, along the rim, between a span and the surface that it continues; rims are rough. A
# span over a piece's own outline lies on its back: where it is no hole, this is far below zero.
_OF_HOLE = -0.5

_OF_OUTLINE = 0.3


@dataclass(frozen=True, eq=False)
class Opening:
    """What a span may close.

    Parameters
    ----------
    rim : (n,) border vertices in the direction of the mesh's own edges; all of a hole's, of a bay's
        those from one side of its mouth to the other.
    mouth : (m, 3) points on the straight way from the last vertex of a bay back to its first.
    agreement : least mean cosine between a span and the surface around for it to be a hole's.
    """

    rim: Ints
    mouth: Floats
    agreement: float


def find_openings(mesh: Mesh, edges: Edges, largest: float, edge: float) -> list[Opening]:
    """Holes and bays whose bounding boxes have no longer diagonal than `largest`.

    Parameters
    ----------
    mesh : manifold; edges : its own.
    edge : edge length of the mesh, world units.
    """
    from scipy.spatial import cKDTree

    loops = boundary_loops(mesh.faces, edges)
    if not loops or largest <= 0:
        return []
    size = np.array([np.linalg.norm(np.ptp(mesh.vertices[loop], axis=0)) for loop in loops])
    part = vertex_parts(mesh.faces, len(mesh.vertices))[[loop[0] for loop in loops]]
    outline = size == _largest_of(part, size)
    everything = cKDTree(mesh.vertices)
    found = []
    for k, loop in enumerate(loops):
        if size[k] <= largest:
            least = _OF_OUTLINE if outline[k] else _OF_HOLE
            found.append(Opening(loop, np.zeros((0, 3)), least))
        else:
            found += _bays(mesh.vertices, loop, everything, largest, edge)
    return found


def _largest_of(part: NDArray[np.int32], size: Floats) -> Floats:
    """(n,) the largest size in each one's part."""
    largest = np.zeros(int(part.max(initial=-1)) + 1)
    np.maximum.at(largest, part, size)
    return largest[part]


def _bays(
    vertices: Floats, loop: Ints, everything: cKDTree, largest: float, edge: float
) -> list[Opening]:
    """The bays of one loop."""
    found = []
    for first, last in find_bays(vertices[loop], everything, largest, edge):
        rim = loop[np.arange(first, last + 1) % len(loop)]
        start, end = vertices[rim[-1]], vertices[rim[0]]
        steps = max(1, round(float(np.linalg.norm(end - start)) / edge))
        share = np.arange(1, steps)[:, None] / steps
        found.append(Opening(rim, start + share * (end - start), _OF_OUTLINE))
    return found


# The way around a bay is at least this many times as long as its mouth is wide, and this many
# edges longer.
_WINDING = 3.0

_LONGER = 8.0

# A mouth keeps this far from the mesh on its way, in edges, but for as much at its ends.
_CLEAR = 0.6

_AT_ENDS = 3.0


@kernel
def _best_ends(points: Floats, along: Floats, widest: float, largest: float, edge: float) -> Ints:
    """(n,) for each start the end of the bay that gains most, -1 = none.

    Parameters
    ----------
    points : (2 n, 3) the loop, twice; along : (2 n,) way from the first.
    """
    n = len(points) // 2
    whole = along[n] - along[0]
    found = np.full(n, -1, dtype=np.int64)
    for i in range(n):
        best = _LONGER * edge
        low, high = points[i].copy(), points[i].copy()
        for j in range(i + 1, i + n):
            low, high = np.minimum(low, points[j]), np.maximum(high, points[j])
            way = along[j] - along[i]
            if np.sqrt(((high - low) ** 2).sum()) > largest or way > 0.5 * whole:
                break
            mouth = np.sqrt(((points[j] - points[i]) ** 2).sum())
            if mouth <= widest and way - _WINDING * mouth > best:
                best, found[i] = way - _WINDING * mouth, j
    return found


def find_bays(
    points: Floats, everything: cKDTree, largest: float, edge: float
) -> list[tuple[int, int]]:
    """First and last vertex of bays that do not overlap, the deepest first.

    Parameters
    ----------
    points : (n, 3) a border loop in the direction of the mesh's own edges.
    everything : all vertices of the mesh.
    largest : diagonal of a bay's bounding box, world units; its mouth is at most half as wide.
    edge : edge length of the mesh.

    Returns
    -------
    (i, j) with i < j; j may exceed n: the loop goes on from its start. A piece of mesh that juts
    out has such ends too: who spans a bay looks on which side the mesh lies.
    """
    n = len(points)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.tile(steps, 2))])[:-1]
    ends = _best_ends(np.tile(points, (2, 1)), along, 0.5 * largest, largest, edge)
    starts = np.flatnonzero(ends >= 0)
    mouth = np.linalg.norm(points[ends[starts] % n] - points[starts], axis=1)
    gain = along[ends[starts]] - along[starts] - _WINDING * mouth
    taken = np.zeros(n, dtype=np.bool_)
    found: list[tuple[int, int]] = []
    for start in starts[np.argsort(-gain, kind="stable")].tolist():
        end = int(ends[start])
        inside = np.arange(start, end + 1) % n
        if not taken[inside].any() and _is_clear(points[start], points[end % n], everything, edge):
            taken[inside] = True
            found.append((start, end))
    return found


def _is_clear(start: Floats, end: Floats, everything: cKDTree, edge: float) -> bool:
    """Whether the straight way between two border vertices does not lead over the mesh."""
    length = float(np.linalg.norm(end - start))
    share = np.arange(_AT_ENDS * edge, length - _AT_ENDS * edge, 0.5 * edge) / max(length, 1e-30)
    if len(share) == 0:
        return True
    way = start + share[:, None] * (end - start)
    return bool((everything.query(way)[0] > _CLEAR * edge).all())

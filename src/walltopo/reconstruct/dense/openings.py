"""Find the openings of a mesh that may be closed: holes, and bays of its boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import Edges, boundary_loops, vertex_components

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

# Minimum mean cosine, along the rim, between a span and the surface that it continues. A hole's
# limit is loose because rims are rough. A span over a component's outer outline would lie on the
# component's back, with a cosine far below zero.
_MIN_COSINE_HOLE = -0.5

_MIN_COSINE_OUTLINE = 0.3


@dataclass(frozen=True, eq=False)
class Opening:
    """An opening of a mesh that a span may close.

    Parameters
    ----------
    rim : (n,) boundary vertices in the direction of the mesh's boundary edges: all vertices of a
        hole, or those of a bay from one side of its mouth to the other.
    mouth : (m, 3) points on the straight line from the last vertex of a bay back to its first.
    min_cosine : minimum mean cosine between a span and the surrounding surface.
    """

    rim: Ints
    mouth: Floats
    min_cosine: float


def find_openings(mesh: Mesh, edges: Edges, largest: float, edge: float) -> list[Opening]:
    """Return the holes and bays whose bounding box has a diagonal of at most `largest`.

    Parameters
    ----------
    mesh : manifold.
    edges : edges of the mesh.
    largest : maximum diagonal, world units.
    edge : edge length of the mesh, world units.
    """
    from scipy.spatial import cKDTree

    loops = boundary_loops(mesh.faces, edges)
    if not loops or largest <= 0:
        return []
    size = np.array([np.linalg.norm(np.ptp(mesh.vertices[loop], axis=0)) for loop in loops])
    part = vertex_components(mesh.faces, len(mesh.vertices))[[loop[0] for loop in loops]]
    outline = size == _largest_in_part(part, size)
    tree = cKDTree(mesh.vertices)
    found = []
    for k, loop in enumerate(loops):
        if size[k] <= largest:
            min_cosine = _MIN_COSINE_OUTLINE if outline[k] else _MIN_COSINE_HOLE
            found.append(Opening(loop, np.zeros((0, 3)), min_cosine))
        else:
            found += _bays_of_loop(mesh.vertices, loop, tree, largest, edge)
    return found


def _largest_in_part(part: NDArray[np.int32], size: Floats) -> Floats:
    """Return for each item the largest size in its part, (n,)."""
    largest = np.zeros(int(part.max(initial=-1)) + 1)
    np.maximum.at(largest, part, size)
    return largest[part]


def _bays_of_loop(
    vertices: Floats, loop: Ints, tree: cKDTree, largest: float, edge: float
) -> list[Opening]:
    """Return the bays of one boundary loop."""
    found = []
    for first, last in find_bays(vertices[loop], tree, largest, edge):
        rim = loop[np.arange(first, last + 1) % len(loop)]
        start, end = vertices[rim[-1]], vertices[rim[0]]
        steps = max(1, round(float(np.linalg.norm(end - start)) / edge))
        share = np.arange(1, steps)[:, None] / steps
        found.append(Opening(rim, start + share * (end - start), _MIN_COSINE_OUTLINE))
    return found


# The boundary of a bay is longer than this many mouth widths, by at least this many edges.
_MIN_LENGTH_RATIO = 3.0

_MIN_EXTRA_EDGES = 8.0

# Minimum distance between a bay's mouth and the mesh, in edges, and the length at each end of the
# mouth that is exempt, in edges.
_MIN_CLEARANCE = 0.6

_EXEMPT_ENDS = 3.0


@kernel
def _best_ends(points: Floats, along: Floats, widest: float, largest: float, edge: float) -> Ints:
    """Return for each start vertex the end of the bay with the largest gain, (n,); -1 = none.

    Parameters
    ----------
    points : (2 n, 3) the loop, twice.
    along : (2 n,) arc length from the first point.
    widest : maximum width of the mouth; largest : maximum diagonal of the bounding box.
    """
    n = len(points) // 2
    whole = along[n] - along[0]
    found = np.full(n, -1, dtype=np.int64)
    for i in range(n):
        best = _MIN_EXTRA_EDGES * edge
        low, high = points[i].copy(), points[i].copy()
        for j in range(i + 1, i + n):
            low, high = np.minimum(low, points[j]), np.maximum(high, points[j])
            length = along[j] - along[i]
            if np.sqrt(((high - low) ** 2).sum()) > largest or length > 0.5 * whole:
                break
            mouth = np.sqrt(((points[j] - points[i]) ** 2).sum())
            if mouth <= widest and length - _MIN_LENGTH_RATIO * mouth > best:
                best, found[i] = length - _MIN_LENGTH_RATIO * mouth, j
    return found


def find_bays(points: Floats, tree: cKDTree, largest: float, edge: float) -> list[tuple[int, int]]:
    """Return the first and last vertices of bays that do not overlap, deepest first.

    Parameters
    ----------
    points : (n, 3) a boundary loop in the direction of the mesh's boundary edges.
    tree : all vertices of the mesh.
    largest : maximum diagonal of a bay's bounding box, world units; its mouth is at most half that.
    edge : edge length of the mesh.

    Returns
    -------
    (i, j) with i < j; indices are modulo n, so j may exceed n. A protruding piece of mesh has such
    ends too; the caller must check on which side the mesh lies.
    """
    n = len(points)
    steps = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1)
    along = np.concatenate([[0.0], np.cumsum(np.tile(steps, 2))])[:-1]
    ends = _best_ends(np.tile(points, (2, 1)), along, 0.5 * largest, largest, edge)
    starts = np.flatnonzero(ends >= 0)
    mouth = np.linalg.norm(points[ends[starts] % n] - points[starts], axis=1)
    gain = along[ends[starts]] - along[starts] - _MIN_LENGTH_RATIO * mouth
    used = np.zeros(n, dtype=np.bool_)
    found: list[tuple[int, int]] = []
    for start in starts[np.argsort(-gain, kind="stable")].tolist():
        end = int(ends[start])
        inside = np.arange(start, end + 1) % n
        if not used[inside].any() and _is_clear(points[start], points[end % n], tree, edge):
            used[inside] = True
            found.append((start, end))
    return found


def _is_clear(start: Floats, end: Floats, tree: cKDTree, edge: float) -> bool:
    """Return whether the straight line between two boundary vertices stays clear of the mesh."""
    length = float(np.linalg.norm(end - start))
    share = np.arange(_EXEMPT_ENDS * edge, length - _EXEMPT_ENDS * edge, 0.5 * edge) / max(
        length, 1e-30
    )
    if len(share) == 0:
        return True
    line = start + share[:, None] * (end - start)
    return bool((tree.query(line)[0] > _MIN_CLEARANCE * edge).all())

"""Where a mesh is open and may be closed: holes, and bays of its border."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.dense.bays import find_bays
from walltopo.meshes.holes import boundary_loops
from walltopo.meshes.topology import Edges, vertex_parts

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

__all__ = ["Opening", "find_openings"]

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

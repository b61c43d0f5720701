"""The border of a triangle mesh as loops, and closing those that are holes."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.topology import Edges, edges_of

Floats = NDArray[np.float64]
Faces = NDArray[np.integer]


def boundary_loops(faces: Faces, edges: Edges | None = None) -> list[NDArray[np.int64]]:
    """Closed chains of border vertices, in the direction of the faces' own edges.

    The mesh must be manifold at its vertices (see `fans`); chains that meet a non-manifold
    vertex are left out.
    """
    edges = edges if edges is not None else edges_of(faces)
    border = (edges.count == 1)[edges.of_face]
    starts = faces[border]
    stops = np.roll(faces, -1, axis=1)[border]
    follow = dict(zip(starts.tolist(), stops.tolist(), strict=True))
    if len(follow) != len(starts):
        doubled = np.flatnonzero(np.bincount(starts) > 1).tolist()
        for vertex in doubled:
            follow.pop(vertex, None)
    loops: list[NDArray[np.int64]] = []
    while follow:
        first, current = follow.popitem()
        loop = [first]
        while current != first and current in follow:
            loop.append(current)
            current = follow.pop(current)
        if current == first and len(loop) >= 3:
            loops.append(np.array(loop, dtype=np.int64))
    return loops


def close_loops(
    vertices: Floats, faces: Faces, loops: Iterable[NDArray[np.int64]]
) -> tuple[Floats, NDArray[np.int32]]:
    """Close border loops, each with a fan around its centre, or with one face if three suffice.

    Parameters
    ----------
    vertices, faces : (V, 3) and (F, 3), of a manifold mesh.
    loops : of `boundary_loops`, those to close.

    Returns
    -------
    Vertices and faces; the old ones keep their numbers.
    """
    points, found = [vertices], [faces.astype(np.int32)]
    count = len(vertices)
    for loop in loops:
        if len(loop) == 3:
            found.append(loop[None, ::-1].astype(np.int32))
            continue
        points.append(vertices[loop].mean(axis=0, keepdims=True))
        fan = np.stack([np.roll(loop, -1), loop, np.full(len(loop), count)], axis=1)
        found.append(fan.astype(np.int32))
        count += 1
    return np.concatenate(points), np.concatenate(found)

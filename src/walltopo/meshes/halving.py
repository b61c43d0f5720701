"""Triangles with new vertices on some of their edges."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["halved"]


def halved(faces: NDArray[np.int32], middle: NDArray[np.int64]) -> NDArray[np.int32]:
    """The triangles cut at new vertices; what is manifold stays so.

    Parameters
    ----------
    faces : (F, 3).
    middle : (F, 3) new vertex on the edge from corner k to corner k + 1, -1 = none. An edge has it
        in all its triangles or in none.
    """
    count = (middle >= 0).sum(axis=1)
    # Turned so that one new vertex lies on the first edge, two on the first and second.
    first = np.where(count == 1, (middle >= 0).argmax(axis=1), (middle < 0).argmax(axis=1) + 1)
    turn = (first[:, None] + np.arange(3)) % 3
    u, v, w = np.take_along_axis(faces, turn, axis=1).T
    p, q, r = np.take_along_axis(middle, turn, axis=1).T
    one, two, three = (count == n for n in (1, 2, 3))
    pieces = [
        faces[count == 0],
        np.stack([u, p, w], axis=1)[one],
        np.stack([p, v, w], axis=1)[one],
        np.stack([p, v, q], axis=1)[two | three],
        np.stack([u, p, q], axis=1)[two],
        np.stack([u, q, w], axis=1)[two],
        np.stack([u, p, r], axis=1)[three],
        np.stack([q, w, r], axis=1)[three],
        np.stack([p, q, r], axis=1)[three],
    ]
    return np.concatenate(pieces).astype(np.int32)

"""Append keypoints and matches to COLMAP's database."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Pair = tuple[int, int]


def append_keypoints(db: Any, number: int, xy: NDArray[np.float32]) -> int:
    """Append keypoints (n, 2) to those of a photo; return the index of the first new one.

    Parameters
    ----------
    db : an open `pycolmap.Database`.
    number : image id.
    xy : COLMAP's pixels.
    """
    known = np.asarray(db.read_keypoints(number)) if db.exists_keypoints(number) else None
    if known is None:
        db.write_keypoints(number, xy)
        return 0
    rows = np.zeros((len(xy), known.shape[1]), known.dtype)
    rows[:, :2] = xy
    if known.shape[1] == 6:  # affine shape; use the unit circle
        rows[:, [2, 5]] = 1
    elif known.shape[1] == 4:  # scale and orientation
        rows[:, 2] = 1
    db.update_keypoints(number, np.concatenate([known, rows]))
    return len(known)


def add_matches(db: Any, pair: Pair, matches: NDArray[Any]) -> bool:
    """Append matches (n, 2) to those of a pair, to be verified; return whether there were any."""
    if not len(matches):
        return False
    known = [np.asarray(db.read_matches(*pair))] if db.exists_matches(*pair) else []
    if known:
        db.delete_matches(*pair)
    if db.exists_two_view_geometry(*pair):
        db.delete_two_view_geometry(*pair)
    db.write_matches(*pair, np.concatenate([*known, matches.astype(np.uint32)]))
    return True

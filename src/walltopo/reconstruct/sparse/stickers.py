"""Tie photos by stickers on bare panels: printed markers with a code of their own, matched exactly.

The points of a sticker follow the SIFT keypoints of its photo in COLMAP's database. A job that
continues another one finds them there.
"""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import combinations
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core.parallel import available_cores
from walltopo.images.files import read_grey
from walltopo.images.markers import detect_stickers
from walltopo.reconstruct.sparse.database import add_matches, append_keypoints
from walltopo.reconstruct.sparse.jobs import ColmapJob

Pair = tuple[int, int]
Floats = NDArray[np.float32]

POINTS = 9  # of a sticker: a grid of 3 x 3 over its square


def add_stickers(database: Path, job: ColmapJob) -> list[Pair]:
    """Find the stickers in all photos and match them; return the pairs to verify.

    Two photos that share two stickers share 18 points, more than `ColmapJob.min_matches` by
    default; one sticker alone adds to their other matches.

    Parameters
    ----------
    database : path of COLMAP's database, with the SIFT features and matches of the job.
    job : job that the database belongs to.
    """
    from walltopo.geometry.colmap import pycolmap

    def find(name: str) -> dict[int, Floats]:
        return sticker_points(read_grey(Path(job.image_root) / name), name)

    with ThreadPoolExecutor(job.threads if job.threads > 0 else available_cores()) as pool:
        found = dict(enumerate(pool.map(find, (entry.name for entry in job.images)), start=1))
    with pycolmap.Database.open(database) as db:
        first = {number: _write_points(db, number, own) for number, own in found.items() if own}
        return [
            (a, b)
            for a, b in combinations(sorted(first), 2)
            if not _has_points(db, (a, b), first[a])
            and add_matches(db, (a, b), _common_matches(found[a], found[b]) + [first[a], first[b]])
        ]


def sticker_points(grey: NDArray[np.uint8], photo: str) -> dict[int, Floats]:
    """Return the points (9, 2) float32 of each sticker in a photo, COLMAP's pixels, by its id.

    An id that is there twice counts for none: which of the two is which cannot be known.

    Parameters
    ----------
    grey : (H, W) uint8.
    photo : file name, for messages.
    """
    points: dict[int, Floats] = {}
    twice = set()
    for detection in detect_stickers(grey, photo):
        if detection.marker in points:
            twice.add(detection.marker)
        points[detection.marker] = _sticker_grid(detection.corners)
    return {marker: points[marker] for marker in sorted(points.keys() - twice)}


def _sticker_grid(corners: NDArray[np.float64]) -> Floats:
    """Return the grid (9, 2) of a sticker by the homography of its corners (4, 2)."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]], np.float32)
    homography = cv2.getPerspectiveTransform(square, corners.astype(np.float32))
    steps = np.array([[(x, y) for y in (0, 0.5, 1) for x in (0, 0.5, 1)]], np.float64)
    return cv2.perspectiveTransform(steps, homography)[0].astype(np.float32)


def _write_points(db: Any, number: int, stickers: Mapping[int, Floats]) -> int:
    """Write a photo's sticker points unless they are there; return the index of the first one."""
    first = 0
    if db.exists_descriptors(number):
        first = int(db.num_descriptors_for_image(number))
    known = int(db.num_keypoints_for_image(number)) if db.exists_keypoints(number) else 0
    if known == first:
        append_keypoints(db, number, np.concatenate(list(stickers.values())))
    return first


def _has_points(db: Any, pair: Pair, first: int) -> bool:
    """Return whether a pair's matches hold points of stickers, taken over from another job."""
    if not db.exists_matches(*pair):
        return False
    return bool((np.asarray(db.read_matches(*pair))[:, 0] >= first).any())


def _common_matches(a: Mapping[int, Floats], b: Mapping[int, Floats]) -> NDArray[np.uint32]:
    """Return the matches (m, 2) of the points of the stickers in both photos, from 0."""
    places_a, places_b = (
        {marker: POINTS * place for place, marker in enumerate(own)} for own in (a, b)
    )
    rows = [
        np.stack([np.arange(POINTS) + places_a[one], np.arange(POINTS) + places_b[one]], axis=1)
        for one in places_a.keys() & places_b.keys()
    ]
    return np.concatenate(rows).astype(np.uint32) if rows else np.zeros((0, 2), np.uint32)

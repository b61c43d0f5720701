"""Learned features beside SIFT's in one database: part of the child process that calls COLMAP.

COLMAP has one list of keypoints a photo. Learned ones are put at its end, so that the numbers of
SIFT's, and the matches and models made of them, stay as they are; a pair's matches are those of
both, verified together.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from walltopo.imaging.photo_file import read_rgb
from walltopo.sparse.job import Job, Learned
from walltopo.sparse.xfeat import Features, XFeat, likeness

__all__ = ["add_learned"]

Pair = tuple[int, int]
S = TypeVar("S")
T = TypeVar("T")


class Tell(Protocol):
    """Tells the parent process how far it is."""

    def __call__(self, **fields: object) -> None: ...


def add_learned(database: Path, job: Job, learned: Learned, tell: Tell) -> list[Pair]:
    """Find learned features in some photos and match them; gives the pairs to verify.

    Parameters
    ----------
    database : holds the photos; `job` : that it belongs to.
    """
    from walltopo.colmap import pycolmap

    network = XFeat()
    with ThreadPoolExecutor(job.threads if job.threads > 0 else os.cpu_count()) as pool:

        def told(what: str, work: Callable[[S], T], items: Sequence[S]) -> Iterator[T]:
            tell(step=what, total=len(items))
            for done in pool.map(work, items):
                tell(advance=1)
                yield done

        def look(number: int) -> Features:
            name = job.images[number - 1].name
            return network.find(read_rgb(Path(job.image_root) / name), learned.points)

        looked = told("learned", look, learned.images)
        found = dict(zip(learned.images, looked, strict=True))
        pairs = partners(found, learned.partners)
        matched = list(
            told("learned matches", lambda ab: network.match(found[ab[0]], found[ab[1]]), pairs)
        )
    with pycolmap.Database.open(database) as db:
        first = {number: _append(db, number, features) for number, features in found.items()}
        return [
            (a, b)
            for (a, b), matches in zip(pairs, matched, strict=True)
            if _add_matches(db, (a, b), matches + np.array([first[a], first[b]]))
        ]


def partners(found: Mapping[int, Features], count: int) -> list[Pair]:
    """The pairs of each photo and the `count` others that are most like it."""
    numbers = sorted(found)
    alike = np.zeros((len(numbers), len(numbers)), dtype=np.int64)
    for i, a in enumerate(numbers):
        for k in range(i + 1, len(numbers)):
            alike[i, k] = alike[k, i] = likeness(found[a], found[numbers[k]])
    return _closest(numbers, alike, count)


def _closest(numbers: Sequence[int], alike: NDArray[np.int64], count: int) -> list[Pair]:
    order = np.argsort(-alike, axis=1, kind="stable")[:, :count]
    chosen = {
        (min(i, k), max(i, k)) for i, row in enumerate(order.tolist()) for k in row if alike[i, k]
    }
    return [(numbers[i], numbers[k]) for i, k in sorted(chosen)]


def _append(db: Any, number: int, features: Features) -> int:
    """Put keypoints behind those that a photo has; the number of the first."""
    known = np.asarray(db.read_keypoints(number)) if db.exists_keypoints(number) else None
    if known is None:
        db.write_keypoints(number, features.xy)
        return 0
    rows = np.zeros((len(features.xy), known.shape[1]), known.dtype)
    rows[:, :2] = features.xy
    if known.shape[1] == 6:  # an affine shape: the unit circle
        rows[:, [2, 5]] = 1
    elif known.shape[1] == 4:  # scale and orientation
        rows[:, 2] = 1
    db.update_keypoints(number, np.concatenate([known, rows]))
    return len(known)


def _add_matches(db: Any, pair: Pair, matches: NDArray[Any]) -> bool:
    """Put matches behind those of a pair; whether there were any."""
    if not len(matches):
        return False
    known = [np.asarray(db.read_matches(*pair))] if db.exists_matches(*pair) else []
    if known:
        db.delete_matches(*pair)
    if db.exists_two_view_geometry(*pair):
        db.delete_two_view_geometry(*pair)
    db.write_matches(*pair, np.concatenate([*known, matches.astype(np.uint32)]))
    return True

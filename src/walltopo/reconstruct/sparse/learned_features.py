"""XFeat features and LighterGlue matches, by ONNX Runtime, in COLMAP's database."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import shipped_file
from walltopo.images.files import read_rgb
from walltopo.images.networks import Network, open_network
from walltopo.reconstruct.sparse.jobs import Job, Learned

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
    from walltopo.geometry.colmap import pycolmap

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


Floats = NDArray[np.float32]


_LONGEST = 1280  # px; photos are looked at no larger

_STRIDE = 32  # the network halves five times

_CELL = 8  # px of one descriptor

_APART = 5  # px between two features at least

_LEAST = 0.05  # of a feature's probability (the authors' default)

_SURE = 0.1  # of a match's probability (the authors' default)

_ALIKE = 0.82  # least cosine of descriptors that speak for a pair of photos (the authors' default)


@dataclass(frozen=True, eq=False)
class Features:
    """Features of one photo, strongest first.

    Parameters
    ----------
    xy : (n, 2) float32, COLMAP's pixel coordinates (the first pixel's centre is 0.5, 0.5).
    descriptors : (n, 64) float32 of length 1.
    size : width and height of the photo, pixels.
    """

    xy: Floats
    descriptors: Floats
    size: tuple[int, int]


class XFeat:
    """Both networks, loaded; several threads may call one, each of which it keeps to."""

    def __init__(self) -> None:
        self._look: Network = open_network(shipped_file("xfeat.onnx"), threads=1)
        self._match: Network = open_network(shipped_file("lighterglue.onnx"), threads=1)

    def find(self, photo: NDArray[np.uint8], most: int) -> Features:
        """The strongest features of a photo.

        Parameters
        ----------
        photo : (height, width, 3) uint8.
        most : features at most.
        """
        height, width = photo.shape[:2]
        shrink = min(1.0, _LONGEST / max(height, width))
        small = [max(1, round(side * shrink / _STRIDE)) * _STRIDE for side in (width, height)]
        grey = cv2.resize(photo, small, interpolation=cv2.INTER_AREA).astype(np.float32).mean(2)
        descriptors, spots, trust = self._look.session.run(None, {"grey": grey[None, None] / 255})
        x, y = _peaks(spots[0, 0])
        trusted = _sample(trust[0], x, y, cv2.INTER_LINEAR)[:, 0]
        score = spots[0, 0][y, x] * trusted
        order = np.argsort(-score, kind="stable")[:most]
        x, y = x[order], y[order]
        rows = _sample(descriptors[0], x, y, cv2.INTER_CUBIC)
        length = np.linalg.norm(rows, axis=1, keepdims=True)
        scale = np.array([width / small[0], height / small[1]])
        xy = (np.stack([x, y], axis=1) + 0.5) * scale
        return Features(xy.astype(np.float32), rows / np.maximum(length, 1e-9), (width, height))

    def match(self, a: Features, b: Features) -> NDArray[np.uint32]:
        """(m, 2) numbers of features of `a` and `b` that are the same spot."""
        if not len(a.xy) or not len(b.xy):
            return np.zeros((0, 2), np.uint32)
        to_b, probability, to_a = (
            found[0]
            for found in self._match.session.run(
                None,
                {
                    "points0": _normalised(a),
                    "descriptors0": a.descriptors[None],
                    "points1": _normalised(b),
                    "descriptors1": b.descriptors[None],
                },
            )
        )
        rows = np.arange(len(to_b))
        good = (to_a[to_b] == rows) & (probability > _SURE)
        return np.stack([rows[good], to_b[good]], axis=1).astype(np.uint32)


def likeness(a: Features, b: Features) -> int:
    """How many features of two photos choose each other: a cheap guess of what `match` finds."""
    if not len(a.xy) or not len(b.xy):
        return 0
    cosine = a.descriptors @ b.descriptors.T
    to_b, to_a = cosine.argmax(axis=1), cosine.argmax(axis=0)
    rows = np.arange(len(to_b))
    return int(((to_a[to_b] == rows) & (cosine[rows, to_b] > _ALIKE)).sum())


def _peaks(spots: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Columns and rows of the local maxima of a map of probabilities."""
    around = cv2.dilate(spots, np.ones((_APART, _APART), np.uint8))
    y, x = np.nonzero((spots == around) & (spots > _LEAST))
    return x, y


def _sample(maps: Floats, x: NDArray[Any], y: NDArray[Any], how: int) -> Floats:
    """(n, channels) of maps (channels, h, w) of `_CELL` pixels a cell, at pixels x, y."""
    if not len(x):
        return np.zeros((0, len(maps)), np.float32)
    at = [((v + 0.5) / _CELL - 0.5).astype(np.float32)[None] for v in (x, y)]
    rows = [cv2.remap(one, at[0], at[1], how, borderMode=cv2.BORDER_REPLICATE)[0] for one in maps]
    return np.stack(rows, axis=1).astype(np.float32)


def _normalised(features: Features) -> Floats:
    """(1, n, 2): the longer side from -1 to 1, the middle at 0."""
    size = np.array(features.size, dtype=np.float32)
    return ((features.xy - size / 2) / (size.max() / 2))[None].astype(np.float32)

"""Find features and matches with ONNX Runtime; write them to COLMAP's database.

The networks are XFeat and LighterGlue, or the larger ones of `larger_network`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any, Protocol, TypeVar

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import shipped_file
from walltopo.core.parallel import available_cores
from walltopo.images.files import read_grey, read_rgb
from walltopo.images.networks import Network, open_network
from walltopo.reconstruct.sparse.database import add_matches, append_keypoints
from walltopo.reconstruct.sparse.feature_sets import (
    Features,
    count_mutual_neighbours,
    match_features,
    shrink_photo,
)
from walltopo.reconstruct.sparse.jobs import ColmapJob, LearnedTask
from walltopo.reconstruct.sparse.larger_network import Aliked, require_larger_network
from walltopo.reconstruct.sparse.pairs import Pair, exhaustive
from walltopo.reconstruct.sparse.quarter_turns import (
    QUARTERS,
    quarter_turns,
    turned_back,
    turned_picture,
)

_TURN_POINTS = 600  # features by which a photo's turn is found
_MAX_TURNED = 40  # photos; the time to find their turns grows with their square

S = TypeVar("S")

T = TypeVar("T")


class ReportEvent(Protocol):
    """Sends an event to the parent process."""

    def __call__(self, **fields: object) -> None: ...


def add_learned(
    database: Path, job: ColmapJob, learned: LearnedTask, report: ReportEvent
) -> list[Pair]:
    """Find learned features in some photos and match them; return the pairs to verify.

    Parameters
    ----------
    database : path of COLMAP's database, with all images registered.
    job : job that the database belongs to.
    report : receives the progress.
    """
    from walltopo.geometry.colmap import pycolmap

    xfeat = XFeat()
    network = Aliked(*require_larger_network(), max(job.threads, 0)) if learned.larger else xfeat
    with ThreadPoolExecutor(job.threads if job.threads > 0 else available_cores()) as pool:

        def with_progress(step: str, work: Callable[[S], T], items: Sequence[S]) -> Iterator[T]:
            report(step=step, total=len(items))
            for done in pool.map(work, items):
                report(advance=1)
                yield done

        def picture(number: int) -> NDArray[np.uint8]:
            return read_rgb(Path(job.image_root) / job.images[number - 1].name)

        def versions(number: int) -> list[Features]:
            photo = picture(number)
            return [
                xfeat.find(turned_picture(photo, turn), _TURN_POINTS) for turn in range(QUARTERS)
            ]

        turns = dict.fromkeys(learned.images, 0)
        if len(turns) <= _MAX_TURNED:
            rows = list(with_progress("turns", versions, learned.images))
            turns = dict(zip(learned.images, quarter_turns(rows), strict=True))

        def detect(number: int) -> Features:
            features = network.find(turned_picture(picture(number), turns[number]), learned.points)
            if not job.masks:
                return features
            mask = Path(job.masks) / f"{job.images[number - 1].name}.png"
            return outside_mask(features, mask, turns[number])

        detected = with_progress("learned", detect, learned.images)
        found = dict(zip(learned.images, detected, strict=True))
        pairs = partners(found, learned.partners)
        matched = list(
            with_progress(
                "learned matches", lambda ab: network.match(found[ab[0]], found[ab[1]]), pairs
            )
        )
    with pycolmap.Database.open(database) as db:
        first = {
            number: append_keypoints(db, number, turned_back(features, turns[number]))
            for number, features in found.items()
        }
        return [
            (a, b)
            for (a, b), matches in zip(pairs, matched, strict=True)
            if add_matches(db, (a, b), matches + np.array([first[a], first[b]]))
        ]


def outside_mask(features: Features, mask: Path, turn: int = 0) -> Features:
    """Return the features that the mask of a photo leaves, all of them without a mask.

    Parameters
    ----------
    turn : quarters by which the photo was turned before its features were found.
    """
    if not mask.exists():
        return features
    allowed = read_grey(mask)
    column, row = np.floor(turned_back(features, turn)).astype(np.int64).T
    height, width = allowed.shape
    kept = allowed[row.clip(0, height - 1), column.clip(0, width - 1)] > 0
    return Features(features.xy[kept], features.descriptors[kept], features.size)


def partners(found: Mapping[int, Features], count: int) -> list[Pair]:
    """Return the pairs of each photo with the `count` photos most similar to it.

    If `count` covers all photos, no similarity is computed.
    """
    numbers = sorted(found)
    if len(numbers) <= count + 1:
        return sorted(exhaustive([number for number in numbers if len(found[number].xy)]))
    similarity = np.zeros((len(numbers), len(numbers)), dtype=np.int64)
    for i, a in enumerate(numbers):
        for k in range(i + 1, len(numbers)):
            similarity[i, k] = similarity[k, i] = count_mutual_neighbours(
                found[a], found[numbers[k]]
            )
    return _closest(numbers, similarity, count)


def _closest(numbers: Sequence[int], similarity: NDArray[np.int64], count: int) -> list[Pair]:
    order = np.argsort(-similarity, axis=1, kind="stable")[:, :count]
    chosen = {
        (min(i, k), max(i, k))
        for i, row in enumerate(order.tolist())
        for k in row
        if similarity[i, k]
    }
    return [(numbers[i], numbers[k]) for i, k in sorted(chosen)]


Floats = NDArray[np.float32]


_MAX_SIDE = 1280  # px; larger photos are reduced to this longer side

_STRIDE = 32  # side lengths must be multiples: the network halves five times

_CELL = 8  # px per cell of the descriptor map

_NMS_WINDOW = 5  # px; side of the window of non-maximum suppression

_MIN_PROBABILITY = 0.05  # minimum probability of a feature (the authors' default)


class XFeat:
    """The XFeat and LighterGlue networks; several threads may call them, each in one thread."""

    def __init__(self) -> None:
        self._extract: Network = open_network(shipped_file("xfeat.onnx"), threads=1)
        self._match: Network = open_network(shipped_file("lighterglue.onnx"), threads=1)

    def find(self, photo: NDArray[np.uint8], max_: int) -> Features:
        """Return the strongest features of a photo.

        Parameters
        ----------
        photo : (height, width, 3) uint8.
        max_ : maximum number of features.
        """
        height, width = photo.shape[:2]
        reduced, scale = shrink_photo(photo, _MAX_SIDE, _STRIDE, _STRIDE)
        descriptors, heatmap, reliability = self._extract.session.run(
            None, {"grey": reduced.mean(2)[None, None] / 255}
        )
        x, y = _peaks(heatmap[0, 0])
        reliabilities = _sample(reliability[0], x, y, cv2.INTER_LINEAR)[:, 0]
        score = heatmap[0, 0][y, x] * reliabilities
        order = np.argsort(-score, kind="stable")[:max_]
        x, y = x[order], y[order]
        rows = _sample(descriptors[0], x, y, cv2.INTER_CUBIC)
        length = np.linalg.norm(rows, axis=1, keepdims=True)
        xy = (np.stack([x, y], axis=1) + 0.5) * scale
        return Features(xy.astype(np.float32), rows / np.maximum(length, 1e-9), (width, height))

    def match(self, a: Features, b: Features) -> NDArray[np.uint32]:
        """Return (m, 2) feature indices of `a` and `b` that match."""
        return match_features(self._match, a, b)


def _peaks(heatmap: Floats) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the columns and rows of the local maxima of a probability map."""
    around = cv2.dilate(heatmap, np.ones((_NMS_WINDOW, _NMS_WINDOW), np.uint8))
    y, x = np.nonzero((heatmap == around) & (heatmap > _MIN_PROBABILITY))
    return x, y


def _sample(maps: Floats, x: NDArray[Any], y: NDArray[Any], interpolation: int) -> Floats:
    """Sample maps (channels, h, w) of `_CELL` pixels per cell at pixels x, y; return (n,
    channels)."""
    if not len(x):
        return np.zeros((0, len(maps)), np.float32)
    at = [((v + 0.5) / _CELL - 0.5).astype(np.float32)[None] for v in (x, y)]
    rows = [
        cv2.remap(one, at[0], at[1], interpolation, borderMode=cv2.BORDER_REPLICATE)[0]
        for one in maps
    ]
    return np.stack(rows, axis=1).astype(np.float32)

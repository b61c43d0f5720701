"""The masks and views of each triangle, as columns sorted by triangle."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel

Ints = NDArray[np.int32]


class Seen(NamedTuple):
    """What one view saw: candidates' numbers, ascending, and see `Evidence` for the others."""

    face: Ints
    label: Ints
    share: NDArray[np.float32]
    ease: NDArray[np.float32]
    border: NDArray[np.float32]
    detail: NDArray[np.float32]


class Columns(NamedTuple):
    """The columns of `Evidence`."""

    projection: Ints
    view: Ints
    share: NDArray[np.float32]
    ease: NDArray[np.float32]
    border: NDArray[np.float32]
    detail: NDArray[np.float32]


def by_face(
    tables: Sequence[Seen], first_mask: NDArray[np.int64], count: int
) -> tuple[Ints, NDArray[np.int64], Columns]:
    """Regroup the views' tables by face, keeping the order of views.

    Faces that no mask was seen on (it lay on something before them) are dropped.

    Parameters
    ----------
    count : of candidates.

    Returns
    -------
    kept : (C,) int32, candidate numbers; starts : (C + 1,) int64; the columns, each (N,).
    """
    entries = np.zeros(count, dtype=np.int32)
    positive = np.zeros(count, dtype=np.bool_)

    def counted(begin: int, end: int) -> None:
        for table in tables:
            _count(begin, end, table.face, table.label, entries, positive)

    in_ranges(counted, count)
    kept = np.flatnonzero(positive).astype(np.int32)
    starts = np.zeros(len(kept) + 1, dtype=np.int64)
    np.cumsum(entries[kept], out=starts[1:])
    place = np.full(count, -1, dtype=np.int64)
    place[kept] = starts[:-1]
    size = int(starts[-1])
    ints = np.zeros((2, size), dtype=np.int32)
    floats = np.zeros((4, size), dtype=np.float32)
    columns = Columns(*ints, *floats)

    def filled(begin: int, end: int) -> None:
        for view, table in enumerate(tables):
            _fill(begin, end, *table, view, int(first_mask[view]), place, *columns)

    in_ranges(filled, count)
    return kept, starts, columns


@kernel
def _from(face: Any, least: Any) -> Any:
    """Where in ascending numbers those from `least` on begin."""
    low, high = 0, len(face)
    while low < high:
        middle = (low + high) // 2
        if face[middle] < least:
            low = middle + 1
        else:
            high = middle
    return low


@kernel
def _count(begin: Any, end: Any, face: Any, label: Any, entries: Any, positive: Any) -> None:
    for k in range(_from(face, begin), _from(face, end)):
        entries[face[k]] += 1
        if label[k] >= 0:
            positive[face[k]] = True


@kernel
def _fill(
    begin: Any, end: Any,
    face: Any, label: Any, in_share: Any, in_ease: Any, in_border: Any, in_detail: Any,
    number: Any, first: Any, place: Any,
    projection: Any, view: Any, share: Any, eased: Any, border: Any, detail: Any,
) -> None:  # fmt: skip
    for k in range(_from(face, begin), _from(face, end)):
        at = place[face[k]]
        if at < 0:
            continue
        place[face[k]] = at + 1
        mask = label[k]
        projection[at] = first + mask if mask >= 0 else (mask - first if mask < -1 else -1)
        view[at], share[at], eased[at] = number, in_share[k], in_ease[k]
        border[at], detail[at] = in_border[k], in_detail[k]

"""How much do the projections share? Sparse products over the triangles, as numba kernels."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.kernels import in_ranges, kernel
from walltopo.lifting.evidence import Evidence

__all__ = ["Overlaps", "overlaps_of", "rows_of", "sort_part"]

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Areas that pairs of projections share.

    Parameters
    ----------
    area : (P,) float64, area of each projection's triangles.
    first, second : (E,) int32, pairs with first < second, sorted; shared : (E,) float64, the
        area of the triangles of both.
    """

    area: Floats
    first: NDArray[np.int32]
    second: NDArray[np.int32]
    shared: Floats


def rows_of(evidence: Evidence) -> tuple[NDArray[np.int64], NDArray[np.int32]]:
    """The entries regrouped by projection: (P + 1,) starts and (n,) face numbers, ascending."""
    return _rows(evidence.starts, evidence.projection, len(evidence.label))


def overlaps_of(evidence: Evidence) -> Overlaps:
    """Shared areas of all pairs of projections that share a triangle: P · diag(area) · Pᵀ."""
    starts, rows = rows_of(evidence)
    count = len(evidence.label)
    area = np.zeros(count)
    np.add.at(area, np.repeat(np.arange(count), np.diff(starts)), evidence.areas[rows])
    sizes = np.zeros(count, dtype=np.int64)
    in_ranges(_pair_counts, count, starts, rows, evidence.starts, evidence.projection, sizes)
    places = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(sizes, out=places[1:])
    second = np.zeros(places[-1], dtype=np.int32)
    shared = np.zeros(places[-1])
    in_ranges(
        _pairs, count, starts, rows, evidence.starts, evidence.projection, evidence.areas, places,
        second, shared,
    )  # fmt: skip
    first = np.repeat(np.arange(count, dtype=np.int32), sizes)
    return Overlaps(area, first, second, shared)


@kernel
def _rows(face_starts: Any, projection: Any, count: Any) -> Any:
    starts = np.zeros(count + 1, dtype=np.int64)
    for p in projection:
        if p >= 0:
            starts[p + 1] += 1
    for p in range(count):
        starts[p + 1] += starts[p]
    rows = np.zeros(starts[count], dtype=np.int32)
    place = starts[:-1].copy()
    for face in range(len(face_starts) - 1):
        for k in range(face_starts[face], face_starts[face + 1]):
            p = projection[k]
            if p >= 0:
                rows[place[p]] = face
                place[p] += 1
    return starts, rows


@kernel
def _pair_counts(
    begin: Any, stop: Any, starts: Any, rows: Any, face_starts: Any, projection: Any, sizes: Any
) -> None:
    met = np.full(len(starts) - 1, -1, dtype=np.int32)
    for p in range(begin, stop):
        for r in range(starts[p], starts[p + 1]):
            for k in range(face_starts[rows[r]], face_starts[rows[r] + 1]):
                q = projection[k]
                if q > p and met[q] != p:
                    met[q] = p
                    sizes[p] += 1


@kernel
def sort_part(values: Any, begin: Any, end: Any) -> None:
    """Put `values[begin:end]` in ascending order, by Shell's sort.

    A few hundred values at most; np.sort alone would double what all of these kernels take to
    compile.
    """
    gap = (end - begin) // 2
    while gap > 0:
        for k in range(begin + gap, end):
            value, at = values[k], k
            while at >= begin + gap and values[at - gap] > value:
                values[at] = values[at - gap]
                at -= gap
            values[at] = value
        gap //= 2


@kernel
def _pairs(
    begin: Any, stop: Any, starts: Any, rows: Any, face_starts: Any, projection: Any, areas: Any,
    places: Any, second: Any, shared: Any,
) -> None:  # fmt: skip
    total = np.zeros(len(starts) - 1)
    for p in range(begin, stop):
        end = places[p]
        for r in range(starts[p], starts[p + 1]):
            face = rows[r]
            for k in range(face_starts[face], face_starts[face + 1]):
                q = projection[k]
                if q > p:
                    if total[q] == 0.0:
                        second[end] = q
                        end += 1
                    total[q] += areas[face]
        sort_part(second, places[p], end)
        for e in range(places[p], end):
            shared[e] = total[second[e]]
            total[second[e]] = 0.0

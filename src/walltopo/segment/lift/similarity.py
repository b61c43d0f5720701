"""Similarity of projections: IoU by area, over all triangles or those that both photos see."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.parallel import cores
from walltopo.geometry.kernels import kernel
from walltopo.segment.lift.alike import Rows, kinds_of, rows_of
from walltopo.segment.lift.evidence import Evidence

Floats = NDArray[np.float64]

Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Covisible:
    """Pairs of projections of different views that share triangles, in both directions.

    Parameters
    ----------
    rows : the entries of each projection.
    area : (P,) float64, area of each projection.
    p, q : (E,) int32, sorted by p, then q.
    shared : (E,) float64, area of the triangles of both.
    p_seen : (E,) area of p that q's view saw; q_seen : (E,) area of q that p's view saw.
    """

    rows: Rows
    area: Floats
    p: Ints
    q: Ints
    shared: Floats
    p_seen: Floats
    q_seen: Floats

    @property
    def iou(self) -> Floats:
        """(E,) overlap of p and q over what both views saw."""
        return self.shared / (self.p_seen + self.q_seen - self.shared)

    @property
    def iou_of_all(self) -> Floats:
        """(E,) overlap of p and q over all their triangles, as published."""
        return self.shared / (self.area[self.p] + self.area[self.q] - self.shared)


def compare_projections(evidence: Evidence) -> Covisible:
    """Compare all projections of different views that share a triangle."""
    rows, kinds = rows_of(evidence), kinds_of(evidence)
    few = rows_of(evidence, kinds.faces)
    count, views = len(evidence.label), len(evidence.first_mask) - 1

    def compared(begin: int, stop: int) -> Any:
        return _compare(
            begin, stop, few.starts, few.number, few.entry, kinds.faces, kinds.areas,
            evidence.starts, evidence.projection, evidence.view, evidence.share, count, views,
        )  # fmt: skip

    area, sizes, q, shared, p_seen = in_chunks(few.starts, compared)
    starts = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(sizes, out=starts[1:])
    p = np.repeat(np.arange(count, dtype=np.int32), sizes)
    return Covisible(rows, area, p, q, shared, p_seen, _mirrored(starts, q, p_seen))


@kernel
def _compare(
    first: Any, stop: Any, starts: Any, number: Any, entry: Any, faces: Any, areas: Any,
    face_starts: Any, projection: Any, view: Any, share: Any, count: Any, views: Any,
) -> Any:  # fmt: skip
    """Of some projections the area, how many others each meets, and those with what they share."""
    total, seen = np.zeros(count), np.zeros(views)
    area, sizes = np.zeros(stop - first), np.zeros(stop - first, dtype=np.int64)
    met, shared, p_seen = np.zeros(1024, dtype=np.int32), np.zeros(1024), np.zeros(1024)
    view_of = np.zeros(count, dtype=np.int32)
    end = 0
    for p in range(first, stop):
        begin = end
        seen[:] = 0.0
        for r in range(starts[p], starts[p + 1]):
            face, whole, mine = faces[number[r]], areas[number[r]], share[entry[r]]
            own = view[entry[r]]
            area[p - first] += whole * mine
            for k in range(face_starts[face], face_starts[face + 1]):
                seen[view[k]] += whole * mine * share[k]
                q = projection[k]
                if q >= 0 and view[k] != own:
                    if total[q] == 0.0:
                        if end == len(met):
                            met, shared, p_seen = longer(met), longer(shared), longer(p_seen)
                        met[end] = q
                        view_of[q] = view[k]
                        end += 1
                    total[q] += whole * min(mine, share[k])
        sort_part(met, begin, end)
        for e in range(begin, end):
            shared[e] = total[met[e]]
            total[met[e]] = 0.0
            p_seen[e] = max(seen[view_of[met[e]]], shared[e])
        sizes[p - first] = end - begin
    return area, sizes, met[:end].copy(), shared[:end].copy(), p_seen[:end].copy()


@kernel
def _mirrored(starts: Any, q: Any, values: Any) -> Any:
    """(E,) of each pair (p, q) the value of (q, p)."""
    place = starts.copy()
    found = np.zeros(len(values))
    # The pairs with q come in the order of their p: the order of the mirrors that begin with q.
    for e in range(len(q)):
        found[place[q[e]]] = values[e]
        place[q[e]] += 1
    return found


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


def overlaps_of(evidence: Evidence) -> Overlaps:
    """Shared areas of all pairs of projections that share a triangle: P · diag(area) · Pᵀ."""
    kinds = kinds_of(evidence)
    rows = rows_of(evidence, kinds.faces)
    count = len(evidence.label)
    owner = np.repeat(np.arange(count), np.diff(rows.starts))
    area = np.bincount(owner, kinds.areas[rows.number], minlength=count).astype(np.float64)

    def compared(begin: int, stop: int) -> Any:
        return _pairs(
            begin, stop, rows.starts, rows.number, kinds.faces, kinds.areas, evidence.starts,
            evidence.projection,
        )  # fmt: skip

    sizes, second, shared = in_chunks(rows.starts, compared)
    first = np.repeat(np.arange(count, dtype=np.int32), sizes)
    return Overlaps(area, first, second, shared)


def in_chunks(
    starts: NDArray[np.int64], work: Callable[[int, int], tuple[NDArray[Any], ...]], parts: int = 64
) -> list[NDArray[Any]]:
    """Call `work(begin, stop)` for runs of projections with about as many entries, on all cores.

    Parameters
    ----------
    starts : of `Rows`.

    Returns
    -------
    What the calls gave, each array joined in their order.
    """
    count = len(starts) - 1
    goals = np.linspace(0, starts[-1], parts + 1)[1:-1]
    inner = np.minimum(np.searchsorted(starts, goals), count)
    with ThreadPoolExecutor(cores()) as pool:
        found = list(pool.map(work, [0, *inner.tolist()], [*inner.tolist(), count]))
    return [np.concatenate(part) for part in zip(*found, strict=True)]


@kernel
def longer(values: Any) -> Any:
    """The values with room for as many again."""
    grown = np.zeros(2 * len(values), dtype=values.dtype)
    grown[: len(values)] = values
    return grown


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
    first: Any, stop: Any, starts: Any, number: Any, faces: Any, areas: Any, face_starts: Any,
    projection: Any,
) -> Any:  # fmt: skip
    """How many later projections each of some meets, and those with the area that they share."""
    total, sizes = np.zeros(len(starts) - 1), np.zeros(stop - first, dtype=np.int64)
    second, shared = np.zeros(1024, dtype=np.int32), np.zeros(1024)
    end = 0
    for p in range(first, stop):
        begin = end
        for r in range(starts[p], starts[p + 1]):
            face, whole = faces[number[r]], areas[number[r]]
            for k in range(face_starts[face], face_starts[face + 1]):
                q = projection[k]
                if q > p:
                    if total[q] == 0.0:
                        if end == len(second):
                            second, shared = longer(second), longer(shared)
                        second[end] = q
                        end += 1
                    total[q] += whole
        sort_part(second, begin, end)
        for e in range(begin, end):
            shared[e] = total[second[e]]
            total[second[e]] = 0.0
        sizes[p - first] = end - begin
    return sizes, second[:end].copy(), shared[:end].copy()

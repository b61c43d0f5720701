"""Similarity of projections: IoU by area. Faces with equal observations are compared once."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.parallel import available_cores
from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.segment.lift.evidence import Evidence

Floats = NDArray[np.float64]

Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Covisible:
    """Pairs of projections of different views that share triangles, in both directions.

    Parameters
    ----------
    rows : the entries of each projection in the evidence.
    area : (P,) float64, area of each projection.
    p, q : (E,) int32, sorted by p, then q.
    shared : (E,) float64, area of the triangles in both.
    p_seen : (E,) area of p that q's view saw; q_seen : (E,) area of q that p's view saw.
    """

    rows: EvidenceRows
    area: Floats
    p: Ints
    q: Ints
    shared: Floats
    p_seen: Floats
    q_seen: Floats

    @property
    def iou(self) -> Floats:
        """Return the (E,) IoU of p and q over the area that both views saw."""
        return self.shared / (self.p_seen + self.q_seen - self.shared)

    @property
    def iou_of_all(self) -> Floats:
        """Return the (E,) IoU of p and q over all their triangles, as published."""
        return self.shared / (self.area[self.p] + self.area[self.q] - self.shared)


def compare_projections(evidence: Evidence) -> Covisible:
    """Return the comparison of all projections of different views that share a triangle."""
    rows, groups = rows_of(evidence), group_faces(evidence)
    group_rows = rows_of(evidence, groups.faces)
    count, views = len(evidence.label), len(evidence.first_mask) - 1

    def compared(begin: int, stop: int) -> Any:
        return _compare(
            begin,
            stop,
            group_rows.starts,
            group_rows.number,
            group_rows.entry,
            groups.faces,
            groups.areas,
            evidence.starts,
            evidence.projection,
            evidence.view,
            evidence.share,
            count,
            views,
        )

    area, sizes, q, shared, p_seen = in_chunks(group_rows.starts, compared)
    starts = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(sizes, out=starts[1:])
    p = np.repeat(np.arange(count, dtype=np.int32), sizes)
    return Covisible(rows, area, p, q, shared, p_seen, _swap_pairs(starts, q, p_seen))


@kernel
def _compare(
    first: Any,
    stop: Any,
    starts: Any,
    number: Any,
    entry: Any,
    faces: Any,
    areas: Any,
    face_starts: Any,
    projection: Any,
    view: Any,
    share: Any,
    count: Any,
    views: Any,
) -> Any:
    """Return areas of projections, and the projections that each overlaps, with shared areas."""
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
                            met, shared, p_seen = (
                                doubled_array(met),
                                doubled_array(shared),
                                doubled_array(p_seen),
                            )
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
def _swap_pairs(starts: Any, q: Any, values: Any) -> Any:
    """Return (E,) for each pair (p, q) the value of the pair (q, p)."""
    place = starts.copy()
    found = np.zeros(len(values))
    # The pairs (., q) come in the order of their p, which is the order of the pairs (q, .).
    for e in range(len(q)):
        found[place[q[e]]] = values[e]
        place[q[e]] += 1
    return found


@dataclass(frozen=True, eq=False)
class Overlaps:
    """The areas that pairs of projections share.

    Parameters
    ----------
    area : (P,) float64, area of each projection's triangles.
    first, second : (E,) int32, pairs with first < second, sorted; shared : (E,) float64, the
        area of the triangles in both.
    """

    area: Floats
    first: NDArray[np.int32]
    second: NDArray[np.int32]
    shared: Floats


def overlaps_of(evidence: Evidence) -> Overlaps:
    """Return shared areas of all pairs of projections with a common triangle: P·diag(area)·Pᵀ."""
    groups = group_faces(evidence)
    rows = rows_of(evidence, groups.faces)
    count = len(evidence.label)
    owner = np.repeat(np.arange(count), np.diff(rows.starts))
    area = np.bincount(owner, groups.areas[rows.number], minlength=count).astype(np.float64)

    def compared(begin: int, stop: int) -> Any:
        return _pairs(
            begin,
            stop,
            rows.starts,
            rows.number,
            groups.faces,
            groups.areas,
            evidence.starts,
            evidence.projection,
        )

    sizes, second, shared = in_chunks(rows.starts, compared)
    first = np.repeat(np.arange(count, dtype=np.int32), sizes)
    return Overlaps(area, first, second, shared)


def in_chunks(
    starts: NDArray[np.int64], work: Callable[[int, int], tuple[NDArray[Any], ...]], parts: int = 64
) -> list[NDArray[Any]]:
    """Call `work(begin, stop)` on all cores, for ranges of projections with similar entry counts.

    Parameters
    ----------
    starts : the `starts` of `EvidenceRows`.

    Returns
    -------
    The results of the calls, each array concatenated in their order.
    """
    count = len(starts) - 1
    goals = np.linspace(0, starts[-1], parts + 1)[1:-1]
    inner = np.minimum(np.searchsorted(starts, goals), count)
    with ThreadPoolExecutor(available_cores()) as pool:
        found = list(pool.map(work, [0, *inner.tolist()], [*inner.tolist(), count]))
    return [np.concatenate(part) for part in zip(*found, strict=True)]


@kernel
def doubled_array(values: Any) -> Any:
    """Return a copy of the array with twice the length."""
    grown = np.zeros(2 * len(values), dtype=values.dtype)
    grown[: len(values)] = values
    return grown


@kernel
def sort_part(values: Any, begin: Any, end: Any) -> None:
    """Put `values[begin:end]` in ascending order, by Shell's sort.

    The kernel sorts a few hundred values at most. np.sort alone would double the time that all of
    these kernels take to compile.
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
    first: Any,
    stop: Any,
    starts: Any,
    number: Any,
    faces: Any,
    areas: Any,
    face_starts: Any,
    projection: Any,
) -> Any:
    """Return for each projection the number of later ones it overlaps, and the shared areas."""
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
                            second, shared = doubled_array(second), doubled_array(shared)
                        second[end] = q
                        end += 1
                    total[q] += whole
        sort_part(second, begin, end)
        for e in range(begin, end):
            shared[e] = total[second[e]]
            total[second[e]] = 0.0
        sizes[p - first] = end - begin
    return sizes, second[:end].copy(), shared[:end].copy()


@dataclass(frozen=True, eq=False)
class FaceGroups:
    """Groups of faces with equal observations: the same masks with the same shares.

    Parameters
    ----------
    faces : (K,) int32, the first face of each group.
    areas : (K,) float64, total area of each group.
    """

    faces: NDArray[np.int32]
    areas: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class EvidenceRows:
    """For each projection, the entries of the evidence at the requested faces.

    Parameters
    ----------
    starts : (P + 1,) int64, first row of each projection.
    number : (n,) int32, index into the requested faces, ascending per projection.
    entry : (n,) int64, index into the columns of the evidence.
    """

    starts: NDArray[np.int64]
    number: NDArray[np.int32]
    entry: NDArray[np.int64]


def rows_of(evidence: Evidence, faces: NDArray[np.int32] | None = None) -> EvidenceRows:
    """Return the entries of some faces (of all if None) regrouped by projection."""
    if faces is None:
        faces = np.arange(len(evidence.faces), dtype=np.int32)
    return EvidenceRows(*_rows(faces, evidence.starts, evidence.projection, len(evidence.label)))


def group_faces(evidence: Evidence) -> FaceGroups:
    """Group the faces whose entries are equal except for distances."""
    count = len(evidence.faces)
    share = evidence.share.view(np.int32)
    digest = np.zeros(count, dtype=np.uint64)
    in_ranges(_digest, count, evidence.starts, evidence.projection, evidence.view, share, digest)
    return FaceGroups(
        *_group(digest, evidence.starts, evidence.projection, evidence.view, share, evidence.areas)
    )


@kernel
def _rows(faces: Any, face_starts: Any, projection: Any, count: Any) -> Any:
    starts = np.zeros(count + 1, dtype=np.int64)
    for face in faces:
        for k in range(face_starts[face], face_starts[face + 1]):
            if projection[k] >= 0:
                starts[projection[k] + 1] += 1
    for p in range(count):
        starts[p + 1] += starts[p]
    number = np.zeros(starts[count], dtype=np.int32)
    entry = np.zeros(starts[count], dtype=np.int64)
    place = starts[:-1].copy()
    for n in range(len(faces)):
        for k in range(face_starts[faces[n]], face_starts[faces[n] + 1]):
            p = projection[k]
            if p >= 0:
                number[place[p]], entry[place[p]] = n, k
                place[p] += 1
    return starts, number, entry


@kernel
def _digest(
    begin: Any, end: Any, starts: Any, projection: Any, view: Any, share: Any, digest: Any
) -> None:
    """Compute a hash of each face's entries, as a filter before `_equal`."""
    for face in range(begin, end):
        mixed = np.uint64(starts[face + 1] - starts[face])
        for k in range(starts[face], starts[face + 1]):
            for value in (projection[k], view[k], share[k]):
                mixed = (mixed ^ np.uint64(np.uint32(value))) * np.uint64(0x9E3779B97F4A7C15)
                mixed ^= mixed >> np.uint64(32)
        digest[face] = mixed


@kernel
def _group(digest: Any, starts: Any, projection: Any, view: Any, share: Any, areas: Any) -> Any:
    """Return first face and total area of each group, in the order of first faces.

    The kernel uses a hash table with open addressing.
    """
    size = 16
    while size < 2 * len(digest):
        size *= 2
    table = np.full(size, -1, dtype=np.int32)
    faces = np.zeros(len(digest), dtype=np.int32)
    total = np.zeros(len(digest))
    count = 0
    for face in range(len(digest)):
        slot = np.int64(digest[face] & np.uint64(size - 1))
        while table[slot] >= 0 and not _equal(
            faces[table[slot]], face, digest, starts, projection, view, share
        ):
            slot = (slot + 1) & (size - 1)
        if table[slot] < 0:
            table[slot], faces[count] = count, face
            count += 1
        total[table[slot]] += areas[face]
    return faces[:count].copy(), total[:count].copy()


@kernel
def _equal(
    one: Any, other: Any, digest: Any, starts: Any, projection: Any, view: Any, share: Any
) -> Any:
    length = starts[one + 1] - starts[one]
    if digest[one] != digest[other] or length != starts[other + 1] - starts[other]:
        return False
    a, b = starts[one], starts[other]
    for k in range(length):
        if projection[a + k] != projection[b + k] or view[a + k] != view[b + k]:
            return False
        if share[a + k] != share[b + k]:
            return False
    return True

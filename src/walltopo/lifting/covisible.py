"""Overlaps of projections over what both of their views saw.

The published overlap counts a triangle that the other photo could not see (cut off by its border,
hidden by something) as disagreement. Here two masks are compared only on triangles that both
views saw.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.kernels import in_ranges, kernel
from walltopo.lifting.evidence import Evidence
from walltopo.lifting.overlap import rows_of, sort_part

__all__ = ["Covisible", "compare_projections"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@dataclass(frozen=True, eq=False)
class Covisible:
    """Pairs of projections of different views that share triangles, in both directions.

    Parameters
    ----------
    starts, rows : (P + 1,) and (n,), faces of each projection as of `rows_of`.
    area : (P,) float64, area of each projection.
    p, q : (E,) int32, sorted by p, then q.
    shared : (E,) float64, area of the triangles of both.
    p_seen : (E,) area of p that q's view saw; q_seen : (E,) area of q that p's view saw.
    """

    starts: NDArray[np.int64]
    rows: Ints
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
    starts, rows = rows_of(evidence)
    view_of = evidence.view_of
    count, views = len(view_of), len(evidence.first_mask) - 1
    chunks = _chunks(starts)
    sizes, area = np.zeros(count, dtype=np.int64), np.zeros(count)
    in_ranges(
        _compare_count, len(chunks) - 1, chunks, starts, rows, evidence.starts,
        evidence.projection, evidence.areas, evidence.share, view_of, evidence.first_mask,
        sizes, area,
    )  # fmt: skip
    places = np.zeros(count + 1, dtype=np.int64)
    np.cumsum(sizes, out=places[1:])
    q = np.zeros(places[-1], dtype=np.int32)
    shared, p_seen = np.zeros(places[-1]), np.zeros(places[-1])
    in_ranges(
        _compare, len(chunks) - 1, chunks, starts, rows, evidence.starts, evidence.projection,
        evidence.view, evidence.areas, evidence.share, view_of, views, places, q, shared, p_seen,
    )  # fmt: skip
    p = np.repeat(np.arange(count, dtype=np.int32), sizes)
    # Sorted by q and then p, the pairs stand as their mirrors (q, p) do by p and then q.
    q_seen = np.zeros_like(p_seen)
    q_seen[np.argsort(q, kind="stable")] = p_seen
    return Covisible(starts, rows, area, p, q, shared, p_seen, q_seen)


def _chunks(starts: NDArray[np.int64], parts: int = 64) -> NDArray[np.int64]:
    """Borders of runs of projections with about the same number of triangles."""
    goals = np.linspace(0, starts[-1], parts + 1)
    borders = np.searchsorted(starts, goals)
    borders[0], borders[-1] = 0, len(starts) - 1
    return np.unique(np.minimum(borders, len(starts) - 1)).astype(np.int64)


@kernel
def _own_share(face_starts: Any, projection: Any, share: Any, face: Any, p: Any) -> Any:
    for k in range(face_starts[face], face_starts[face + 1]):
        if projection[k] == p:
            return share[k]
    return np.float32(0.0)


@kernel
def _compare_count(
    begin: Any, stop: Any, chunks: Any, starts: Any, rows: Any, face_starts: Any,
    projection: Any, areas: Any, share: Any, view_of: Any, first_mask: Any, sizes: Any, area: Any,
) -> None:  # fmt: skip
    met = np.full(len(view_of), -1, dtype=np.int32)
    for chunk in range(begin, stop):
        for p in range(chunks[chunk], chunks[chunk + 1]):
            low, high = first_mask[view_of[p]], first_mask[view_of[p] + 1]
            for r in range(starts[p], starts[p + 1]):
                for k in range(face_starts[rows[r]], face_starts[rows[r] + 1]):
                    q = projection[k]
                    if q == p:
                        area[p] += areas[rows[r]] * share[k]
                    elif q >= 0 and (q < low or q >= high) and met[q] != p:
                        met[q] = p
                        sizes[p] += 1


@kernel
def _compare(
    begin: Any, stop: Any, chunks: Any, starts: Any, rows: Any, face_starts: Any,
    projection: Any, view: Any, areas: Any, share: Any, view_of: Any, views: Any, places: Any,
    second: Any, shared: Any, p_seen: Any,
) -> None:  # fmt: skip
    total, seen = np.zeros(len(view_of)), np.zeros(views)
    for chunk in range(begin, stop):
        for p in range(chunks[chunk], chunks[chunk + 1]):
            seen[:] = 0.0
            end = places[p]
            for r in range(starts[p], starts[p + 1]):
                face = rows[r]
                mine = _own_share(face_starts, projection, share, face, p)
                for k in range(face_starts[face], face_starts[face + 1]):
                    q = projection[k]
                    seen[view[k]] += areas[face] * mine * share[k]
                    if q >= 0 and view_of[q] != view_of[p]:
                        if total[q] == 0.0:
                            second[end] = q
                            end += 1
                        total[q] += areas[face] * min(mine, share[k])
            sort_part(second, places[p], end)
            for e in range(places[p], end):
                shared[e] = total[second[e]]
                total[second[e]] = 0.0
                p_seen[e] = max(seen[view_of[second[e]]], shared[e])

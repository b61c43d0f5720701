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

from walltopo.kernels import kernel
from walltopo.lifting.alike import Rows, kinds_of, rows_of
from walltopo.lifting.evidence import Evidence
from walltopo.lifting.overlap import in_chunks, longer, sort_part

__all__ = ["Covisible", "compare_projections"]

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

"""How much do the projections share? Sparse products over the triangles, as numba kernels."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.cores import cores
from walltopo.kernels import kernel
from walltopo.lifting.alike import kinds_of, rows_of
from walltopo.lifting.evidence import Evidence

__all__ = ["Overlaps", "in_chunks", "longer", "overlaps_of", "sort_part"]

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

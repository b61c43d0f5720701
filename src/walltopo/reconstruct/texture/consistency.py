"""Leave out photos that contradict the others: somebody stood before that part of the wall.

Photos are compared as by Waechter, Moehrle and Goesele, "Let there be color!", 2014: colours of one
triangle in several photos are alike, except where a photo shows something else. A person covers
many triangles, so that what a photo contradicts is averaged over the surface; borders of holds that
are a pixel off and highlights are small and stay.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import in_ranges, kernel
from walltopo.reconstruct.texture.candidates import Candidates

Single = NDArray[np.float32]
Bytes = NDArray[np.uint8]
Ints = NDArray[np.int32]

_MIN_PHOTOS = 3  # two photos that differ do not tell which one is right
# Rounds of averaging with the three neighbours, and the largest averaged difference (of 255) of a
# photo that paints: chosen on a generated gym with pasted people.
_ROUNDS, _MAX_DIFFERENCE = 4, 24
_UNKNOWN = 255  # larger differences are stored as 254: a byte each, because halls are large


def leave_out_contradicted(
    candidates: Candidates, gains: NDArray[np.float64], adjacent: Ints
) -> None:
    """Remove from each triangle's candidates the photos whose colour the others contradict.

    At least one candidate of each triangle stays.

    Parameters
    ----------
    candidates : changed in place.
    gains : (n, 3) factor on each photo's colours.
    adjacent : (F, 3) triangle across each edge, -1 = none.
    """
    view, count = candidates.view, len(candidates.view)
    differences = np.empty(view.shape, dtype=np.uint8)
    factors = gains.astype(np.float32)
    in_ranges(_differences, count, view, candidates.colour, factors, differences)
    averaged = np.empty_like(differences)
    for _ in range(_ROUNDS):
        in_ranges(_average, count, view, adjacent, differences, averaged)
        differences, averaged = averaged, differences
    in_ranges(_remove, count, differences, _MAX_DIFFERENCE, view)


@kernel
def _differences(
    begin: int,
    end: int,
    view: NDArray[np.int16],
    colour: Bytes,
    gains: Single,
    differences: Bytes,
) -> None:
    """Fill in how far each photo's colour is from the median of the photos, by the channel that
    differs most; `_UNKNOWN` for too few photos."""
    slots = view.shape[1]
    values = np.empty(slots, dtype=np.float32)
    for f in range(begin, end):
        photos = 0
        for k in range(slots):
            photos += view[f, k] >= 0
            differences[f, k] = _UNKNOWN if view[f, k] < 0 else 0
        if photos < _MIN_PHOTOS:
            differences[f] = _UNKNOWN
            continue
        for channel in range(3):
            known = 0
            for k in range(slots):
                if view[f, k] >= 0:
                    values[known] = colour[f, k, channel] * gains[view[f, k], channel]
                    known += 1
            ordered = np.sort(values[:known])
            median = (ordered[(known - 1) // 2] + ordered[known // 2]) / 2
            known = 0
            for k in range(slots):
                if view[f, k] >= 0:
                    away = np.uint8(min(abs(values[known] - median) + 0.5, _UNKNOWN - 1.0))
                    differences[f, k] = max(differences[f, k], away)
                    known += 1


@kernel
def _average(
    begin: int,
    end: int,
    view: NDArray[np.int16],
    adjacent: Ints,
    differences: Bytes,
    averaged: Bytes,
) -> None:
    """Fill in the mean of each difference and those of the same photo at the neighbours."""
    slots = view.shape[1]
    for f in range(begin, end):
        for k in range(slots):
            total, known = 0, 0
            if differences[f, k] != _UNKNOWN:
                total, known = int(differences[f, k]), 1
            for n in range(3):
                other = adjacent[f, n]
                for m in range(slots if other >= 0 and view[f, k] >= 0 else 0):
                    if view[other, m] == view[f, k] and differences[other, m] != _UNKNOWN:
                        total += int(differences[other, m])
                        known += 1
            averaged[f, k] = np.uint8((total + known // 2) // known) if known else _UNKNOWN


@kernel
def _remove(begin: int, end: int, differences: Bytes, limit: int, view: NDArray[np.int16]) -> None:
    """Remove the candidates that differ by more than a limit, unless all of a triangle do."""
    slots = view.shape[1]
    for f in range(begin, end):
        least = -1
        for k in range(slots):
            if view[f, k] >= 0 and (least < 0 or differences[f, k] < differences[f, least]):
                least = k
        for k in range(slots):
            if k != least and limit < differences[f, k] < _UNKNOWN:
                view[f, k] = -1

"""One photo per triangle, in large patches: chosen by how well it sees it and by its neighbours."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.kernels import kernel
from walltopo.geometry.neighbours import patches
from walltopo.reconstruct.texture.candidates import Candidates

# The preference for equal neighbours grows over the sweeps, so that good photos spread first.
_SWEEPS = 12
# Charts of fewer triangles take a neighbour's photo where it sees them too.
_LEAST_CHART = 200


@kernel
def _sweep(
    view: NDArray[np.int16],
    gain: NDArray[np.float32],
    adjacent: NDArray[np.int32],
    strength: float,
    label: NDArray[np.int16],
    forward: bool,
) -> int:
    """Give every triangle the candidate that suits it and its neighbours best (in place)."""
    changed = 0
    count = len(label)
    for step in range(count):
        f = step if forward else count - 1 - step
        best, best_value = label[f], -np.inf
        for k in range(view.shape[1]):
            if view[f, k] < 0:
                continue
            value = gain[f, k]
            for n in range(3):
                other = adjacent[f, n]
                if other >= 0 and label[other] == view[f, k]:
                    value += strength
            if value > best_value:
                best, best_value = view[f, k], value
        if best != label[f]:
            label[f] = best
            changed += 1
    return changed


def choose_labels(
    candidates: Candidates, adjacent: NDArray[np.int32], smoothness: float
) -> NDArray[np.int16]:
    """(F,) int16 view of each triangle, -1 where no photo saw it.

    Iterated conditional modes on log(score) plus `smoothness` per equal neighbour: a local
    optimum of the energy of Lempitsky and Ivanov, "Seamless mosaicing of image-based texture
    maps", 2007.
    """
    view = candidates.view
    gain = np.log(np.maximum(candidates.score, 1e-6)).astype(np.float32)
    best = np.where(view >= 0, gain, -np.inf).argmax(axis=1)
    label = view[np.arange(len(view)), best].copy()
    for sweep in range(_SWEEPS):
        strength = smoothness * (sweep + 1) / _SWEEPS
        _sweep(view, gain, adjacent, strength, label, sweep % 2 == 0)
    _absorb_small(view, adjacent, label)
    return label


@kernel
def _relabel(
    view: NDArray[np.int16],
    adjacent: NDArray[np.int32],
    small: NDArray[np.bool_],
    label: NDArray[np.int16],
) -> None:
    """Triangles of small charts take the label of a neighbour outside where it sees them."""
    for f in range(len(label)):
        if not small[f]:
            continue
        for n in range(3):
            other = adjacent[f, n]
            if other < 0 or small[other] or label[other] == label[f]:
                continue
            for k in range(view.shape[1]):
                if view[f, k] >= 0 and view[f, k] == label[other]:
                    label[f] = label[other]
                    small[f] = False


def _absorb_small(
    view: NDArray[np.int16], adjacent: NDArray[np.int32], label: NDArray[np.int16]
) -> None:
    """Dissolve charts of a few triangles into their neighbours (in place)."""
    for _ in range(3):
        chart, _ = patches(adjacent, label)
        small = (np.bincount(chart) < _LEAST_CHART)[chart] & (label >= 0)
        for _ in range(8):
            _relabel(view, adjacent, small, label)

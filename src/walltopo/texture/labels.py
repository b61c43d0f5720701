"""One photo per triangle, in large patches: labels, and charts of equal labels."""

from __future__ import annotations

import numpy as np
from numba import njit
from numpy.typing import NDArray

from walltopo.texture.candidates import Candidates

__all__ = ["charts_of", "choose_labels", "neighbours_of"]

# The preference for equal neighbours grows over the sweeps, so that good photos spread first.
_SWEEPS = 12
# Charts of fewer triangles take a neighbour's photo where it sees them too.
_LEAST_CHART = 200


def neighbours_of(faces: NDArray[np.int32]) -> NDArray[np.int32]:
    """(F, 3) face across the edge from corner k to k + 1, -1 at the rim or where it is no
    manifold."""
    directed = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1).reshape(-1, 2)
    low, high = directed.min(axis=1).astype(np.int64), directed.max(axis=1).astype(np.int64)
    key = low * (int(faces.max(initial=0)) + 1) + high
    order = np.argsort(key, kind="stable")
    _, first, count = np.unique(key[order], return_index=True, return_counts=True)
    pair = first[count == 2]
    result = np.full(len(faces) * 3, -1, dtype=np.int32)
    one, two = order[pair], order[pair + 1]
    result[one], result[two] = two // 3, one // 3
    return result.reshape(-1, 3)


@njit(cache=True)
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


def charts_of(label: NDArray[np.int16], adjacent: NDArray[np.int32]) -> NDArray[np.int32]:
    """(F,) int32 number of each triangle's chart: linked triangles of one label."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    face, corner = np.nonzero(adjacent >= 0)
    other = adjacent[face, corner]
    same = label[face] == label[other]
    n = len(label)
    graph = coo_matrix(
        (np.ones(int(same.sum()), dtype=np.bool_), (face[same], other[same])), shape=(n, n)
    )
    return connected_components(graph, directed=False)[1]


@njit(cache=True)
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
        chart = charts_of(label, adjacent)
        small = (np.bincount(chart) < _LEAST_CHART)[chart] & (label >= 0)
        for _ in range(8):
            _relabel(view, adjacent, small, label)

"""Level colours: one gain per photo, then a smooth correction that closes the seams."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core.parallel import available_cores
from walltopo.geometry.graphs import symmetric_matrix
from walltopo.geometry.kernels import kernel
from walltopo.geometry.topology import edges_of
from walltopo.reconstruct.texture.candidates import Candidates

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]

# Darker or brighter colours are clipped and say nothing about the exposure.
_DARK, _BRIGHT = 12, 243
# Maximum log ratio; a larger one is due to a highlight, not to exposure.
_MAX_LOG_RATIO = 0.7
# Seam levelling: weights of closed seams, smoothness and small corrections.
_SEAM = 10.0
_SMOOTH = 1.0
_DAMP = 2e-3


def photo_gains(candidates: Candidates, count: int) -> Floats:
    """Return the (count, 3) factor per photo and channel that equalises the photos.

    The mean log ratio of two photos is taken over their shared triangles without outliers
    (highlights). The log gains are solved by least squares with mean zero.
    """
    total = np.zeros((count, count, 3))
    number = np.zeros((count, count))
    logs = np.log(np.maximum(np.arange(256.0), 1.0))
    _sum_ratios(candidates.view, candidates.colour, logs, total, number)
    total, number = total - total.transpose(1, 0, 2), number + number.T
    # log g_i - log g_j = mean log(c_j / c_i), each pair weighted by the triangles it shares.
    scale = max(float(number.max()), 1.0)
    system = np.diag(number.sum(axis=1)) - number + 1e-4 * scale * np.eye(count)
    gains = np.exp(np.linalg.solve(system, total.sum(axis=1)))
    return np.asarray(np.clip(gains, 0.3, 3.0))


@kernel
def _sum_ratios(view: Any, colour: Any, logs: Any, total: Any, number: Any) -> None:
    """Sum log(c_j / c_i) over triangles that photos i and j both see, and count them."""
    slots = view.shape[1]
    for a in range(slots):
        for b in range(a + 1, slots):
            for f in range(len(view)):
                i, j = view[f, a], view[f, b]
                usable = i >= 0 and j >= 0
                for channel in range(3):
                    one, two = colour[f, a, channel], colour[f, b, channel]
                    usable = usable and min(one, two) >= _DARK and max(one, two) <= _BRIGHT
                    usable = usable and abs(logs[two] - logs[one]) < _MAX_LOG_RATIO
                if usable:
                    number[i, j] += 1.0
                    for channel in range(3):
                        ratio = logs[colour[f, b, channel]] - logs[colour[f, a, channel]]
                        total[i, j, channel] += ratio


def level_seams(corner_node: Ints, node_vertex: NDArray[np.int64], node_colour: Floats) -> Floats:
    """Return the (N, 3) colour correction per node that closes the seams between charts.

    A node is a vertex in one chart; a vertex on a seam has several. The solution minimises the
    squared differences of the corrected colours of a vertex's nodes, plus the squared differences
    of corrections along edges (Lempitsky and Ivanov, 2007).

    Parameters
    ----------
    corner_node : (F, 3) int32 node of each triangle's corner.
    node_vertex : (N,) vertex of each node, ascending.
    node_colour : (N, 3) colour of the node in its own photo.
    """
    from scipy.sparse.linalg import LinearOperator, cg

    count = len(node_vertex)
    one = np.flatnonzero(node_vertex[1:] == node_vertex[:-1])
    edges = edges_of(corner_node)
    pairs = np.concatenate([np.stack([one, one + 1], axis=1).astype(np.int32), edges.pairs])
    weights = np.concatenate([np.full(len(one), _SEAM), _SMOOTH * edges.count])
    del edges
    graph = symmetric_matrix(count, pairs[:, 0], pairs[:, 1], weights)
    del pairs, weights
    diagonal = np.asarray(graph.sum(axis=1)).ravel() + _DAMP
    system = LinearOperator((count, count), matvec=lambda x: diagonal * x - graph @ x)
    inverse = LinearOperator((count, count), matvec=lambda x: x / diagonal)
    step = _SEAM * (node_colour[one + 1] - node_colour[one])
    right = np.zeros_like(node_colour)
    right[one] += step
    right[one + 1] -= step

    def solved(channel: int) -> Floats:
        start = right[:, channel]
        return np.asarray(cg(system, start, M=inverse, rtol=1e-3, maxiter=150)[0])

    with ThreadPoolExecutor(available_cores()) as pool:
        return np.stack(list(pool.map(solved, range(3))), axis=1)

"""Smooth borders: each instance's border is the cheapest one near where the vote put it.

The energy of an instance is the sum, over its faces, of area x log-odds against it, plus
`border_smoothness` x mean edge length x the length of its border. Among all ways to label a band
of faces around the voted border, a minimum cut finds the best.

Rules: only faces of the band change, and only between the instance and no instance. A face of
another instance is never taken; a border between two instances costs nothing, so that neither
shrinks from it, nor does the end of the mesh. A face is gained only where a mask of the instance,
or its soft border, lies on it; one that two instances gain goes to the larger share of evidence
(then the lower number). An instance that would lose its last face stays as it was.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.lifting.contract import LiftParams
from walltopo.lifting.evidence import Evidence
from walltopo.lifting.regions import neighbours_of
from walltopo.lifting.vote import ballots_of, log_odds

__all__ = ["cheapest_side", "smooth_borders"]

Ints = NDArray[np.int32]
Floats = NDArray[np.float64]
Rows = NDArray[np.int64]

# The band: so many faces on either side of the border.
RINGS = 4
# All capacities add up to less than this, so that residuals fit into 32 bits.
MOST_FLOW = 2.0**29


def smooth_borders(
    mesh: Mesh,
    evidence: Evidence,
    neighbours: Ints,
    cluster: Ints,
    winner: Ints,
    shares: NDArray[np.float32],
    params: LiftParams,
) -> tuple[Ints, NDArray[np.float32]]:
    """Move the borders of all clusters to where they are short and still in the evidence.

    Parameters
    ----------
    neighbours : (C, 3), as of `neighbours_of`; cluster : (P,) of each projection.
    winner, shares : (C,), as of `vote`.

    Returns
    -------
    `winner` and `shares` after the cut.
    """
    corners = mesh.vertices[mesh.faces[evidence.faces]]
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    cost = lengths * (params.border_smoothness * float(lengths.mean()))
    # No neighbour: the mesh goes on where no mask ever was, or it ends, which is no border.
    ends_mesh = neighbours_of(mesh.faces, len(mesh.vertices))[evidence.faces] < 0
    cost[ends_mesh] = 0.0
    even = float(np.clip(params.threshold, 0.01, 0.99))
    ballots = ballots_of(evidence, cluster, params.border_band)
    smooth, sure = winner.copy(), shares.copy()
    taken = np.zeros(len(winner))
    order = np.argsort(winner, kind="stable")
    numbers = np.arange(int(winner.max(initial=-1)) + 1)
    begins = np.searchsorted(winner[order], numbers)
    ends = np.searchsorted(winner[order], numbers, side="right")
    for number, begin, end in zip(numbers.tolist(), begins, ends, strict=True):
        own = order[begin:end]
        band = _band(neighbours, winner, own, number)
        odds, share = log_odds(evidence, cluster, ballots, band, number)
        possible = (winner[band] == number) | (share > 0)
        band, odds, share = band[possible], odds[possible], share[possible]
        gain = evidence.areas[band] * (odds - np.log(even / (1 - even)))
        inside = _cut(neighbours, cost, winner, band, number, gain)
        before = winner[band] == number
        lost, gained = before & ~inside, ~before & inside & (share > taken[band])
        if lost.sum() == len(own):
            continue
        smooth[band[lost]], sure[band[lost]] = -1, 0.0
        smooth[band[gained]], sure[band[gained]] = number, share[gained]
        taken[band[gained]] = share[gained]
    return smooth, sure


def _band(neighbours: Ints, winner: Ints, own: Rows, number: int) -> Rows:
    """Faces of the cluster, or of none, within `RINGS` of the border between the two."""
    around = neighbours[own]
    free = (around >= 0) & (winner[around] < 0)
    near = np.union1d(own[free.any(axis=1)], around[free])
    for _ in range(RINGS - 1):
        around = neighbours[near].ravel()
        around = around[around >= 0]
        around = around[(winner[around] < 0) | (winner[around] == number)]
        near = np.union1d(near, around)
    return near.astype(np.int64)


def _cut(
    neighbours: Ints, cost: Floats, winner: Ints, band: Rows, number: int, gain: Floats
) -> NDArray[np.bool_]:
    """(n,) bool: the faces of the band that lie on the cluster's side of the cut."""
    if len(band) == 0:
        return np.zeros(0, dtype=np.bool_)
    around, price = neighbours[band], cost[band]
    place = np.minimum(np.searchsorted(band, around), len(band) - 1)
    within = (around >= 0) & (band[place] == around)
    # What lies outside the band is fixed, and pulls to its own side.
    label = np.where(around >= 0, winner[around], -1)
    pull = np.where(label == number, 1.0, np.where(label < 0, -1.0, 0.0))
    gain = gain + (price * pull * ~within).sum(axis=1)
    row = np.broadcast_to(np.arange(len(band))[:, None], around.shape)
    once = within & (row < place)
    return cheapest_side(gain, row[once], place[once], price[once])


def cheapest_side(gain: Floats, first: Rows, second: Rows, price: Floats) -> NDArray[np.bool_]:
    """The set that maximises the sum of its gains less the price of the pairs it parts.

    Parameters
    ----------
    gain : (n,), any sign.
    first, second, price : (E,) pairs, each once, and what it costs to part them (>= 0).

    Returns
    -------
    (n,) bool. Of several best sets the smallest, so that the result is unique.
    """
    from scipy.sparse import coo_array, csr_array
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = len(gain)
    source, sink = count, count + 1
    every = np.arange(count)
    rows = np.concatenate([np.full(count, source), every, first, second])
    cols = np.concatenate([every, np.full(count, sink), second, first])
    capacity = np.concatenate([np.maximum(gain, 0), np.maximum(-gain, 0), price, price])
    # Flow needs whole numbers: these are fine enough that rounding moves no border.
    scaled = np.rint(capacity * (MOST_FLOW / max(float(capacity.sum()), 1e-300)))
    shape = (count + 2, count + 2)
    graph = csr_array(coo_array((scaled.astype(np.int32), (rows, cols)), shape=shape))
    residual = csr_array(graph - maximum_flow(graph, source, sink).flow)
    residual.eliminate_zeros()
    inside = np.zeros(count + 2, dtype=np.bool_)
    inside[breadth_first_order(residual, source, return_predecessors=False)] = True
    return inside[:count]

"""Holds of one colour to routes: a graph by path length, then Louvain.

The similarity of two holds is 1 up to `min_hold_dist`, falls linearly, and is 0 from
`max_hold_dist` on. Louvain maximises modularity at a resolution; as in NetworkX, a larger
`resolution` gives more and smaller groups.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.graphs.components import components
from walltopo.graphs.louvain import louvain
from walltopo.routes.paint import FLATTEN, REACH, cues_of, likeness, may_be_linked

__all__ = [
    "Grouping",
    "best_louvain",
    "candidate_pairs",
    "group_by_paint",
    "group_holds",
    "modularity",
    "similarity",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

RESTARTS = 8  # Louvain runs with different node orders; the best modularity wins

Lengths = Callable[[Ints], Floats]


@dataclass(frozen=True, eq=False)
class Grouping:
    """Groups of holds and how sure they are.

    Parameters
    ----------
    group : (n,) int64, number of each hold's group, from 0; -1 for holds outside the graph.
    similarity : (n, n) float64 in [0, 1], symmetric, zero diagonal; zero across colours.
    """

    group: Ints
    similarity: Floats


def similarity(length: Floats, near: float, far: float) -> Floats:
    """1 up to `near`, linear down to 0 at `far` (a step where both are equal)."""
    if far - near < 1e-9:
        return (length <= near).astype(np.float64)
    return np.clip((far - length) / (far - near), 0.0, 1.0)


def candidate_pairs(points: Floats, labels: Sequence[str], ratio: float, far: float) -> Ints:
    """Pairs of equal label whose straight, flattened distance is below `far`.

    A path is never shorter than the straight line, so no other pair can be similar.

    Returns
    -------
    (P, 2) int64, sorted, first < second.
    """
    flat = points * np.array([1.0, 1.0, ratio])
    groups: dict[str, list[int]] = {}
    for number, label in enumerate(labels):
        groups.setdefault(label, []).append(number)
    found = [np.zeros((0, 2), dtype=np.int64)]
    for members in groups.values():
        rows = np.array(members)
        one, two = np.triu_indices(len(rows), 1)
        distance = np.linalg.norm(flat[rows[one]] - flat[rows[two]], axis=1)
        near = distance < far
        found.append(np.column_stack([rows[one[near]], rows[two[near]]]))
    pairs = np.vstack(found)
    return pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))]


def best_louvain(weights: Floats, resolution: float, seed: int) -> Ints:
    """Groups of one weighted graph: of `RESTARTS` runs of Louvain the one of highest modularity.

    Parameters
    ----------
    weights : (n, n) float64, symmetric, >= 0, zero diagonal.
    resolution : factor on the expected weight in modularity; 0 joins all that is connected.

    Returns
    -------
    (n,) int64, numbered from 0 in the order of first members; isolated nodes are alone.
    """
    n = len(weights)
    one, two = np.nonzero(np.triu(weights, 1))
    if resolution == 0 or len(one) == 0:
        return components(n, one, two).astype(np.int64)
    best, best_score = np.arange(n), -np.inf
    for restart in range(RESTARTS):
        found = louvain(n, one, two, weights[one, two], resolution, seed + restart)
        groups = found.astype(np.int64)
        score = modularity(weights, groups, resolution)
        if score > best_score + 1e-12:
            best, best_score = groups, score
    return best


def modularity(weights: Floats, groups: Ints, resolution: float) -> float:
    """Newman's modularity of a grouping at a resolution, in [-1, 1] for resolution 1."""
    total = weights.sum()
    degree = weights.sum(axis=1)
    same = groups[:, None] == groups[None, :]
    expected = resolution * np.outer(degree, degree) / total
    return float(((weights - expected) * same).sum() / total)


def _links(count: int, pairs: Ints, weights: Floats) -> Floats:
    links = np.zeros((count, count))
    links[pairs[:, 0], pairs[:, 1]] = links[pairs[:, 1], pairs[:, 0]] = weights
    return links


def group_by_paint(
    points: Floats,
    paint: Floats,
    lengths: Lengths,
    *,
    unit: float,
    resolution: float,
    seed: int = 0,
) -> Grouping:
    """Group holds into routes without naming their colours first.

    One graph of all holds, linked by `paint.likeness`. For scans whose light is too uneven
    to name colours.

    Parameters
    ----------
    points : (n, 3) positions; paint : (n, 3) of `paint.balanced_paint`.
    lengths : as in `group_holds`, with `paint.FLATTEN` as the ratio.
    unit : scan units a metre.
    resolution : of Louvain, for all colours together.
    """
    pairs = candidate_pairs(points, [""] * len(points), FLATTEN, REACH * unit)
    pairs = pairs[may_be_linked(points / unit, paint, pairs)]
    weights = np.zeros(0)
    if len(pairs):
        weights = likeness(cues_of(points / unit, paint, pairs, lengths(pairs) / unit))
    links = _links(len(points), pairs, weights)
    return Grouping(best_louvain(links, resolution, seed), links)


def group_holds(
    points: Floats,
    labels: Sequence[str],
    lengths: Lengths,
    *,
    near: float,
    far: float,
    ratio: float,
    resolution: float,
    seed: int = 0,
) -> Grouping:
    """Group holds into routes, each colour by itself.

    Parameters
    ----------
    points : (n, 3) float64, positions of the holds, metres.
    labels : colour of each hold; holds of different colours never share a route.
    lengths : called once with (P, 2) pairs of hold numbers, returns (P,) flattened path
        lengths (inf where there is no path).
    near, far, ratio, resolution : see `params.RoutesSettings`.
    """
    pairs = candidate_pairs(points, labels, ratio, far)
    weights = similarity(lengths(pairs), near, far) if len(pairs) else np.zeros(0)
    links = _links(len(points), pairs, weights)
    group = np.full(len(points), -1, dtype=np.int64)
    count = 0
    # Colours in the order of their first hold: names do not matter.
    for label in dict.fromkeys(labels):
        rows = np.array([k for k, other in enumerate(labels) if other == label])
        own = best_louvain(links[np.ix_(rows, rows)], resolution, seed)
        group[rows] = own + count
        count += int(own.max()) + 1
    return Grouping(group, links)

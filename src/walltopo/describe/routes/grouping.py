"""Group holds into routes: a graph by path length and paint, then Louvain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.geometry.graphs import components, louvain
from walltopo.images.colour import features

Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

RESTARTS = 8  # Louvain runs with different node orders; the best modularity wins

Lengths = Callable[[Ints], Floats]


@dataclass(frozen=True, eq=False)
class Grouping:
    """Groups of holds and the similarity of their members.

    Parameters
    ----------
    group : (n,) int64, number of each hold's group, from 0; -1 for holds outside the graph.
    similarity : (n, n) float64 in [0, 1], symmetric, zero diagonal; zero across colours.
    """

    group: Ints
    similarity: Floats


def similarity(length: Floats, near: float, far: float) -> Floats:
    """Return 1 up to `near`, falling linearly to 0 at `far` (a step if both are equal)."""
    if far - near < 1e-9:
        return (length <= near).astype(np.float64)
    return np.clip((far - length) / (far - near), 0.0, 1.0)


def candidate_pairs(points: Floats, labels: Sequence[str], ratio: float, far: float) -> Ints:
    """Return pairs with equal label whose straight, flattened distance is below `far`.

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
    """Return the groups of a weighted graph: the best of `RESTARTS` Louvain runs by modularity.

    Parameters
    ----------
    weights : (n, n) float64, symmetric, >= 0, zero diagonal.
    resolution : factor on the expected weight in modularity; 0 gives connected components.

    Returns
    -------
    (n,) int64, numbered from 0 in the order of first members; an isolated node is a group.
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
    """Return Newman's modularity of a grouping at a resolution, in [-1, 1] for resolution 1."""
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
    second: Floats | None = None,
) -> Grouping:
    """Group holds into routes without naming their colours first.

    One graph of all holds, linked by `link_weights`, for scans whose light is too uneven to name
    colours.

    Parameters
    ----------
    points : (n, 3) positions; paint : (n, 3), see `balanced_paint`.
    lengths : as in `group_holds`, with `FLATTEN` as the ratio.
    unit : scan units per metre.
    resolution : Louvain resolution, for all colours together.
    second : (n, 3) second paint of two-coloured holds, NaN for others. Two holds are as similar as
        their most similar paints.
    """
    second = np.full_like(paint, np.nan) if second is None else second
    places, paints = np.tile(points / unit, (2, 1)), np.vstack([paint, second])
    pairs = candidate_pairs(points, [""] * len(points), FLATTEN, REACH * unit)
    row, of_paints = paint_pairs(second, pairs)
    pairs = pairs[np.unique(row[may_be_linked(places, paints, of_paints)])]
    weights = np.zeros(0)
    if len(pairs):
        weights = strongest_links(points / unit, paint, second, pairs, lengths(pairs) / unit)
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
    """Group holds into routes, each colour separately.

    Parameters
    ----------
    points : (n, 3) float64, positions of the holds, metres.
    labels : colour of each hold; holds of different colours never share a route.
    lengths : called once with (P, 2) pairs of hold numbers, returns (P,) flattened path
        lengths (inf if no path exists).
    near, far, ratio, resolution : see `RoutesSettings`.
    """
    pairs = candidate_pairs(points, labels, ratio, far)
    weights = similarity(lengths(pairs), near, far) if len(pairs) else np.zeros(0)
    links = _links(len(points), pairs, weights)
    group = np.full(len(points), -1, dtype=np.int64)
    count = 0
    # Group colours in the order of their first hold, so that names have no influence.
    for label in dict.fromkeys(labels):
        rows = np.array([k for k, other in enumerate(labels) if other == label])
        own = best_louvain(links[np.ix_(rows, rows)], resolution, seed)
        group[rows] = own + count
        count += int(own.max()) + 1
    return Grouping(group, links)


REACH = 2.2  # metres: maximum flattened path between linked holds

FLATTEN = 0.2  # factor on the vertical part of a path, as in the fit of `WEIGHTS`

SHARPEN = 3  # power of the probability: Louvain works best with few, confident links

RESOLUTION = 2.0  # of Louvain, over all colours

MIN_LINK = 0.01  # weaker links are dropped

WEIGHTS = (1.396, -3.006, -18.504, -2.768, 0.324, -1.729, 0.201, -10.911)

BIAS = 3.026


def balanced_paint(linear: Floats, tint: Floats) -> Floats:
    """Return (n, 3) paint of holds under one light: chroma (2) and lightness, see `features`.

    Parameters
    ----------
    linear : (n, 3) linear RGB of the holds, under one exposure.
    tint : (n, 3) > 0, relative colour of the light at each hold (`SceneLight.tint_at`). Only its
        variation between holds counts, because the mean is the wall's own paint.
    """
    logs = np.log(tint)
    logs = logs - logs.mean(axis=1, keepdims=True)
    logs = logs - np.median(logs, axis=0)
    white = 0.8 / max(float(np.percentile(linear.mean(axis=1), 98)), 1e-9)
    return features(linear * np.exp(-logs) * white, 1.0)


def paint_pairs(second: Floats, pairs: Ints) -> tuple[Ints, Ints]:
    """Return the pairs of paints of each pair of holds.

    Parameters
    ----------
    second : (n, 3) second paint of two-coloured holds, NaN for others.
    pairs : (P, 2) hold numbers.

    Returns
    -------
    (Q,) row of `pairs`, and (Q, 2) paints: k is the first paint of hold k, n + k its second.
    """
    has = np.isfinite(second[:, 0])
    shifts = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
    rows = [np.flatnonzero((has[pairs] | (shift == 0)).all(axis=1)) for shift in shifts]
    paints = [pairs[row] + len(second) * shift for row, shift in zip(rows, shifts, strict=True)]
    return np.concatenate(rows), np.concatenate(paints)


def strongest_links(
    points: Floats, paint: Floats, second: Floats, pairs: Ints, lengths: Floats
) -> Floats:
    """Return (P,) the link weight of each pair of holds by their most similar paints.

    Parameters
    ----------
    points, paint, pairs, lengths : as in `cues_of`; second : as in `paint_pairs`.
    """
    row, of_paints = paint_pairs(second, pairs)
    both = np.vstack([paint, second])
    cues = cues_of(np.tile(points, (2, 1)), both, of_paints, lengths[row])
    weights = np.zeros(len(pairs))
    np.maximum.at(weights, row, link_weights(cues))
    return weights


def cues_of(points: Floats, paint: Floats, pairs: Ints, lengths: Floats) -> Floats:
    """Return (P, 8) the four cues of each pair and their squares.

    Parameters
    ----------
    points : (n, 3) positions, metres; paint : (n, 3), see `balanced_paint`.
    pairs : (P, 2) hold numbers; lengths : (P,) flattened path lengths, metres.
    """
    one, two = pairs[:, 0], pairs[:, 1]
    aside = np.linalg.norm(points[one, :2] - points[two, :2], axis=1)
    away = paint[one] - paint[two]
    chroma = np.linalg.norm(away[:, :2], axis=1)
    four = np.column_stack([lengths, aside, chroma, np.abs(away[:, 2])])
    return np.hstack([four, four**2])


def may_be_linked(points: Floats, paint: Floats, pairs: Ints) -> NDArray[np.bool_]:
    """Return (P,) whether a pair may be linked, whatever the length of its path.

    The odds are convex in the path length, which lies between the straight, flattened line and
    `REACH`. Their maximum is therefore at one of the two ends.
    """
    flat = points * np.array([1.0, 1.0, FLATTEN])
    straight = np.linalg.norm(flat[pairs[:, 0]] - flat[pairs[:, 1]], axis=1)
    longest = np.full(len(pairs), np.nextafter(REACH, 0.0))
    ends = [link_weights(cues_of(points, paint, pairs, length)) for length in (straight, longest)]
    return np.asarray(np.maximum(*ends) > 0)


def link_weights(cues: Floats) -> Floats:
    """Return (P,) the link weight of each pair in [0, 1]: its probability, sharpened."""
    near = cues[:, 0] < REACH
    odds = np.where(near[:, None], cues, 0.0) @ np.array(WEIGHTS) + BIAS
    weight = np.where(near, 1 / (1 + np.exp(-odds)), 0.0) ** SHARPEN
    return np.where(weight < MIN_LINK, 0.0, weight)

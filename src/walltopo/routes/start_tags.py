"""Routes of one colour cut where their start tags say that there are several.

A tag belongs to a hold beside it, and that hold to a start: one hold, or two that a climber
spans. A group in which tags mark several starts is cut into as many routes. Each route is a line
that leaves its start and rises, with its holds scattered to both sides; holds go to the nearest
line, and lines are fitted to their holds in turn (k-means for lines, with a weak belief that
routes go straight up). Which tags are one start is decided by what costs least altogether: an
additional start costs `NEW_START`, two holds of one start cost their distance, holds their
distance from the line. All costs are negative logarithms of Gaussian odds.

The numbers were chosen on generated gyms (docs/routes.md).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold, StartTag

__all__ = ["Cut", "cut_at_starts", "tagged_holds"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]
Starts = list[list[int]]

BESIDE = 0.3  # metres from a tag to the rim of its hold, at most
LOW = 0.5  # share of its group's height up to which a hold may be a start
SCATTER = 0.25  # metres that holds lie to the left and right of their route's line
LEAN = 0.2  # metres that a line moves sideways per metre of height
SPAN = 0.5  # metres between the two holds of a start
REACH = 1.5  # metres that they are apart at most
NEW_START = 30.0  # what an additional start costs; two holds 3 m off their line cost more
MOST_TAGGED = 8  # with more tagged holds in a group the nearest are paired, lines unseen
ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Cut:
    """Groups after cutting.

    Parameters
    ----------
    group : (n,) int64, as in `grouping.Grouping`.
    odds : for each hold of a group that was cut, row of a start hold to the probability that
        the hold is of that start's route.
    """

    group: Ints
    odds: Mapping[int, Mapping[int, float]] = field(default_factory=dict)


def tagged_holds(
    tags: Sequence[StartTag], holds: Sequence[Hold], group: Ints, unit: float
) -> dict[int, int]:
    """Tag id to the row of the hold it belongs to; tags without a hold beside them are left out.

    Of the holds beside a tag in the lower half of their groups those of its band's colour come
    first, and of these the nearest. (A tag beside the top of a route marks its top.)

    Parameters
    ----------
    holds : the holds that are grouped; group : (n,) int64, their groups.
    unit : scan units a metre.
    """
    if not holds:
        return {}
    points = np.array([hold.position for hold in holds])
    rims = np.array([hold.size_m for hold in holds]) / 2
    low = np.zeros(len(holds), dtype=np.bool_)
    for number in np.unique(group):
        rows = group == number
        heights = points[rows, 2]
        low[rows] = heights <= heights.min() + LOW * np.ptp(heights)
    found = {}
    for tag in tags:
        away = np.linalg.norm(points - np.array(tag.position), axis=1) - rims
        away[~low] = np.inf
        same = np.array([hold.colour == tag.colour for hold in holds])
        if (away[same] <= BESIDE * unit).any():
            away[~same] = np.inf
        row = int(away.argmin())
        if away[row] <= BESIDE * unit:
            found[tag.id] = row
    return found


def cut_at_starts(holds: Sequence[Hold], group: Ints, tagged: Sequence[int], unit: float) -> Cut:
    """Cut each group in which tagged holds mark several starts; other groups stay as they are.

    Parameters
    ----------
    tagged : rows of the holds that tags belong to; unit : scan units a metre.
    """
    result = group.copy()
    odds: dict[int, dict[int, float]] = {}
    for number in np.unique(group[list(tagged)]) if len(tagged) else ():
        rows = np.flatnonzero(group == number)
        starts = [k for k, row in enumerate(rows) if row in set(tagged)]
        if len(starts) < 2:
            continue
        flat = _along_and_up([holds[row] for row in rows.tolist()]) / unit
        blocks, own, shares = _routes(flat, starts)
        for block in range(1, len(blocks)):
            result[rows[own == block]] = int(result.max()) + 1
        if len(blocks) > 1:
            for row, share in zip(rows.tolist(), shares, strict=True):
                odds[row] = {
                    int(rows[block[0]]): float(p) for block, p in zip(blocks, share, strict=True)
                }
    return Cut(result, odds)


def _along_and_up(holds: Sequence[Hold]) -> Floats:
    """(n, 2) how far right and how high each hold is, seen from in front of the wall."""
    points = np.array([hold.position for hold in holds])
    out = np.mean([hold.normal for hold in holds], axis=0)
    if np.hypot(out[0], out[1]) > 0.2 * np.linalg.norm(out):
        right = np.array([-out[1], out[0]]) / np.hypot(out[0], out[1])
    else:  # a roof has no right; its holds extend along some direction
        right = np.linalg.svd(points[:, :2] - points[:, :2].mean(axis=0))[2][0]
    return np.column_stack([points[:, :2] @ right, points[:, 2]])


def _routes(flat: Floats, tagged: list[int]) -> tuple[Starts, Ints, Floats]:
    """The cheapest way to see tagged holds as starts of routes.

    Returns
    -------
    The starts; (n,) the start whose route each hold is of; (n, starts) probabilities of that.
    """
    options = []
    for starts in _ways(flat, tagged):
        own, shares, cost = _lines(flat, starts)
        spans = [flat[start[-1]] - flat[start[0]] for start in starts]
        cost += NEW_START * len(starts) + 0.5 * sum(float(p @ p) for p in spans) / SPAN**2
        options.append((cost, starts, own, shares))
    _, starts, own, shares = min(options, key=lambda option: option[0])
    return starts, own, shares


def _ways(flat: Floats, tagged: list[int]) -> Iterator[Starts]:
    """All ways to pair some of the tagged holds; only the nearest first where there are many."""
    if len(tagged) <= MOST_TAGGED:
        yield from _pairings(flat, tagged)
        return
    left, starts = list(tagged), []
    while left:
        first = left.pop(0)
        away = [float(np.linalg.norm(flat[other] - flat[first])) for other in left]
        near = int(np.argmin(away)) if away else -1
        second = [left.pop(near)] if away and away[near] <= REACH else []
        starts.append([first, *second])
    yield starts


def _pairings(flat: Floats, tagged: list[int]) -> Iterator[Starts]:
    if not tagged:
        yield []
        return
    first, rest = tagged[0], tagged[1:]
    for way in _pairings(flat, rest):
        yield [[first], *way]
    for k, other in enumerate(rest):
        if np.linalg.norm(flat[other] - flat[first]) <= REACH:
            for way in _pairings(flat, rest[:k] + rest[k + 1 :]):
                yield [[first, other], *way]


def _lines(flat: Floats, starts: Starts) -> tuple[Ints, Floats, float]:
    """Share holds out among lines that rise from starts: owners, probabilities, cost."""
    count = len(starts)
    fixed = np.full(len(flat), -1)
    for number, start in enumerate(starts):
        fixed[start] = number
    feet = np.array([flat[start].mean(axis=0) for start in starts])
    offset, lean = feet[:, 0].copy(), np.zeros(count)
    rise = flat[:, 1:] - feet[:, 1]
    own = np.full(len(flat), -1)
    away = np.zeros((len(flat), count))
    for _ in range(ROUNDS):
        away = 0.5 * ((flat[:, :1] - offset - lean * rise) / SCATTER) ** 2
        nearest = np.where(fixed >= 0, fixed, away.argmin(axis=1))
        if (nearest == own).all():
            break
        own = nearest
        for number in range(count):
            rows = own == number
            terms = np.column_stack([np.ones(int(rows.sum())), rise[rows, number]]) / SCATTER
            normal = terms.T @ terms + np.diag([0.0, 1 / LEAN**2])
            offset[number], lean[number] = np.linalg.solve(
                normal, terms.T @ flat[rows, 0] / SCATTER
            )
    cost = float(away[np.arange(len(flat)), own].sum() + 0.5 * (lean**2).sum() / LEAN**2)
    shares = np.exp(away.min(axis=1, keepdims=True) - away)
    shares[fixed >= 0] = np.eye(count)[fixed[fixed >= 0]]
    return own, shares / shares.sum(axis=1, keepdims=True), cost

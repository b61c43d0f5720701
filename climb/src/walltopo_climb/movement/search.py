"""Find the cheapest sequence of moves: Dijkstra's search over stances (numba).

Stances are the nodes and moves of one limb the edges, as in Bretl et al. (2004) and in the stance
graph of Naderi, Rajamäki and Hämäläinen (2017). A move is possible if one hip position reaches the
holds of the three resting limbs and the target of the fourth.
"""

from __future__ import annotations

import heapq
import math

import numpy as np
import numpy.typing as npt

from walltopo.geometry.kernels import kernel
from walltopo_climb.movement.statics import NONE, hold_on, place_hip

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# Costs of a move, in units of the effort of hanging with one's weight on one jug. The sources do
# not give these weights; they influence the appearance of the moves more than the fitted grades.
_HAND = 0.30  # a hand moves
_FOOT = 0.12  # a foot moves
_WAY = 0.25  # per body height that the limb travels
_LEAP = 150.0  # per squared body height that a move is beyond reach
_LEAPS = 0.8  # per leap
_SWING = 3.0  # per squared unbalanced moment (weight times height)
_CUT = 0.6  # a foot leaves the wall
_CROSS = 1.5  # per body height by which hands, or feet, are crossed
_MATCH = 0.25  # two limbs on one hold
_APART = 0.95  # of the arm span: maximum distance of the hands
_HIGH = 0.30  # of the height: twice the minimum height of the upper hand over a foot


@kernel
def move_cost(
    position: Floats,
    wall: Floats,
    pull: Floats,
    hand: Floats,
    outward: Floats,
    foot: Floats,
    limbs: Ints,
    moving: int,
    body: Floats,
    max_leap: float,
    hip: Floats,
) -> tuple[float, float]:
    """Return the cost of the last move into a stance, infinite if impossible.

    `limbs` : the stance after the move of limb `moving`. Return the cost without the distance, and
    the distance beyond reach (m).
    """
    height = body[0]
    lack = place_hip(position, wall, limbs, body, hip)
    # Feet do not leap; a hand does, from a possible hip position.
    max_lack = max_leap if moving < 2 else 0.03 * height
    if lack > max_lack:
        return math.inf, lack
    effort, swing = hold_on(position, wall, pull, hand, outward, foot, limbs, moving, hip, body)
    cost = effort + _SWING * swing * swing
    if moving < 2 and lack > 0.0:
        cost += _LEAPS + _LEAP * (lack / height) ** 2
    return cost, lack


@kernel
def _limb_cost(position: Floats, side: Floats, limbs: Ints, height: float, span: float) -> float:
    """Return the cost of crossed and matched limbs, infinite if the stance is impossible."""
    a, b, c, d = limbs[0], limbs[1], limbs[2], limbs[3]
    cost = 0.0
    if a != NONE and b != NONE:
        across = apart = 0.0
        for k in range(3):
            across += (position[a, k] - position[b, k]) * side[k]
            apart += (position[a, k] - position[b, k]) ** 2
        if apart > (_APART * span) ** 2:
            return math.inf
        if a == b:
            cost += _MATCH
        elif across > 0.0:
            cost += _CROSS * across / height
            if across > 0.35 * height:
                return math.inf
    if c != NONE and d != NONE:
        across = 0.0
        for k in range(3):
            across += (position[c, k] - position[d, k]) * side[k]
        if c == d:
            cost += _MATCH
        elif across > 0.0:
            cost += 2 * _CROSS * across / height
            if across > 0.2 * height:
                return math.inf
    top = max(position[a, 2], position[b, 2])
    for k in range(2, 4):
        i = limbs[k]
        if i == NONE:
            continue
        if position[i, 2] > top - _HIGH * height * 0.5:
            return math.inf
        if i in (a, b):
            cost += _MATCH
    return cost


@kernel
def find_stances(
    position: Floats,
    wall: Floats,
    pull: Floats,
    hand: Floats,
    outward: Floats,
    foot: Floats,
    side: Floats,
    start: Ints,
    top: Ints,
    body: Floats,
    max_leap: float,
    max_seen: int,
) -> tuple[Ints, bool]:
    """Return the cheapest sequence of stances from a start to the top with both hands.

    Parameters
    ----------
    position .. foot : see `Grips`. side : (3,) unit, to the climber's right.
    start, top : (n,) holds on which hands may start, and the top holds.
    body : see `place_hip`. max_leap : metres that a hand may go beyond reach.
    max_seen : number of stances after which the search gives up.

    Returns
    -------
    (M, 4) stances from first to last; and whether the last one is the top. If not, it is the one
    in which the lower hand is highest. Empty if this body cannot start.
    """
    n = len(hand)
    m = n + 1
    height = body[0]
    # Both arms and the shoulders: the maximum distance of the hands.
    span = 2 * (body[2] + body[4])
    size = n * n * m * m
    best = np.full(size, np.inf, np.float32)
    before = np.full(size, -1, np.int32)
    done = np.zeros(size, np.bool_)
    limbs = np.empty(4, np.int64)
    hip = np.empty(3)
    heap = [(0.0, -1)]
    heapq.heappop(heap)
    is_top = np.zeros(n, np.bool_)
    for t in top:
        is_top[t] = True
    # Starts: every pair of footholds with every pair of start holds.
    for a in start:
        for b in start:
            for c in range(m):
                for d in range(m):
                    limbs[0], limbs[1], limbs[2], limbs[3] = a, b, c - 1, d - 1
                    if (c > 0 and foot[c - 1] <= 0) or (d > 0 and foot[d - 1] <= 0):
                        continue
                    cost = _limb_cost(position, side, limbs, height, span)
                    if cost == math.inf:
                        continue
                    held, lack = move_cost(
                        position, wall, pull, hand, outward, foot, limbs, 4, body, 0.0, hip
                    )
                    if lack > 0.03 * height:
                        continue
                    state = ((a * n + b) * m + c) * m + d
                    cost += held
                    if cost < best[state]:
                        best[state] = cost
                        heapq.heappush(heap, (cost, state))
    seen = 0
    goal = farthest = -1
    highest = -1e9
    while len(heap) > 0:
        cost, state = heapq.heappop(heap)
        if done[state]:
            continue
        done[state] = True
        seen += 1
        if seen > max_seen:
            break
        d = state % m
        c = state // m % m
        b = state // (m * m) % n
        a = state // (m * m * n)
        if is_top[a] and is_top[b]:
            goal = state
            break
        lower = min(position[a, 2], position[b, 2])
        if lower > highest:
            highest, farthest = lower, state
        for moving in range(4):
            for to in range(m):
                limbs[0], limbs[1], limbs[2], limbs[3] = a, b, c - 1, d - 1
                old = limbs[moving]
                target = to - 1
                if target == old:
                    continue
                if moving < 2:
                    if target == NONE or hand[target] <= 0.0:
                        continue
                    new = (
                        ((target * n + b) * m + c) * m + d
                        if moving == 0
                        else ((a * n + target) * m + c) * m + d
                    )
                else:
                    if target != NONE and foot[target] <= 0.0:
                        continue
                    new = (
                        ((a * n + b) * m + to) * m + d
                        if moving == 2
                        else ((a * n + b) * m + c) * m + to
                    )
                if done[new]:
                    continue
                limbs[moving] = target
                way = 0.0
                if target != NONE and old != NONE:
                    for k in range(3):
                        way += (position[target, k] - position[old, k]) ** 2
                    way = math.sqrt(way)
                    if way > 1.3 * height:
                        continue
                step = (_HAND if moving < 2 else _FOOT) + _WAY * way / height
                if target == NONE:
                    step += _CUT
                if cost + step >= best[new]:
                    continue
                step += _limb_cost(position, side, limbs, height, span)
                if cost + step >= best[new]:
                    continue
                held, lack = move_cost(
                    position, wall, pull, hand, outward, foot, limbs, moving, body, max_leap, hip
                )
                total = cost + step + held
                if total < best[new]:
                    best[new] = total
                    before[new] = state
                    heapq.heappush(heap, (total, new))
    reached = goal >= 0
    last = goal if reached else farthest
    count = 0
    state = last
    while state >= 0:
        count += 1
        state = before[state]
    way_up = np.empty((count, 4), np.int64)
    state = last
    while state >= 0:
        count -= 1
        way_up[count, 0] = state // (m * m * n)
        way_up[count, 1] = state // (m * m) % n
        way_up[count, 2] = state // m % m - 1
        way_up[count, 3] = state % m - 1
        state = before[state]
    return way_up, reached

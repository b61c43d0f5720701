"""What a climber wants of a route: order, start, top, footholds, ambiguous holds, facts."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold
from walltopo.scans.bounds import Rgb
from walltopo.scans.edits import RoleName
from walltopo.scans.routes import Ambiguous, Route

__all__ = [
    "STRONGEST",
    "ceiling_of",
    "colour_of",
    "describe_route",
    "memberships",
    "route_facts",
    "usual_size",
]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FOOT_SHARE = 0.55  # below this share of the scan's median hold size a hold is for feet
# Of a typical move between hand holds, by `python -m walltopo_lab.benchmarks.starts choose`.
START_RISE = 1.5  # two start holds differ in height by at most so much
START_SPREAD = 2.0  # and are so far apart at most
LEVEL = 0.9  # the second of a pair that is higher by more may be no start
LEVEL_TOP = 0.15  # of two holds that differ by less either may be the top
SMALL = 0.7  # of the usual hold: what is for hands by its type, but smaller, may be for feet
ROOM = 0.6  # of a typical move: so much wall with holds above a top may have one that was missed
UNSURE_SIZE = (0.4, 0.9)  # of the usual hold, where the type is unknown: for hands or for feet
STRONGEST = 3  # similarities that speak for a hold's membership of a route


def _is_foothold(hold: Hold, median_size: float) -> bool:
    return hold.type == "foothold" or (
        hold.type == "unknown" and 0 < hold.size < FOOT_SHARE * median_size
    )


def bottom_to_top(holds: Sequence[Hold]) -> list[Hold]:
    """Holds by height, ties by id."""
    return sorted(holds, key=lambda hold: (hold.position[2], hold.id))


def _start(hands: Sequence[Hold]) -> tuple[Hold, ...]:
    """The lowest hand hold, and the next one where both hands can start on the pair.

    That is where the next is no higher, and no farther away, than a typical move; one hold must be
    left for the top.
    """
    if len(hands) < 3:
        return tuple(hands[:1])
    points = np.array([hold.position for hold in hands])
    typical = _typical_move(hands)
    rise, apart = points[1, 2] - points[0, 2], float(np.linalg.norm(points[1] - points[0]))
    if rise <= START_RISE * typical and apart <= START_SPREAD * typical:
        return hands[0], hands[1]
    return (hands[0],)


def _typical_move(hands: Sequence[Hold]) -> float:
    points = np.array([hold.position for hold in hands])
    return float(np.median(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def _doubtful_start(
    ordered: Sequence[Hold], hands: Sequence[Hold], usual: float, ambiguous: Collection[int]
) -> str:
    """Why the start may be another one; empty where all speaks for it."""
    start = _start(hands)
    if any(hold.id in ambiguous for hold in start):
        return "a start hold may be of another route"
    lowest = [hold for hold in ordered if hold.position[2] <= start[-1].position[2]]
    if any(_may_be_either(hold, usual) for hold in lowest):
        return "a hold at the start may be for the feet, or for the hands"
    if len(hands) < 3:
        return ""
    rise = hands[1].position[2] - hands[0].position[2]
    pair = len(start) == 2
    return "one start hold or two" if (rise > LEVEL * _typical_move(hands)) == pair else ""


def _doubtful_top(
    ordered: Sequence[Hold],
    hands: Sequence[Hold],
    usual: float,
    ambiguous: Collection[int],
    ceiling: float,
) -> str:
    """Why the top may be another one; empty where all speaks for it."""
    top = hands[-1]
    if top.id in ambiguous:
        return "the top hold may be of another route"
    above = [hold for hold in ordered if hold.position[2] >= top.position[2]]
    if any(_may_be_either(hold, usual) for hold in above):
        return "a hold at the top may be for the feet, or for the hands"
    if len(hands) < 3:
        return ""
    if ceiling - top.position[2] > ROOM * _typical_move(hands):
        return "the wall has holds above it: one may have been missed"
    rise = top.position[2] - hands[-2].position[2]
    return "two holds are about as high" if rise < LEVEL_TOP * _typical_move(hands) else ""


def _may_be_either(hold: Hold, usual: float) -> bool:
    """Whether type and size disagree on what a hold is for, or neither tells."""
    if hold.type == "unknown":
        low, high = UNSURE_SIZE
        return low * usual < hold.size < high * usual
    if hold.type == "foothold":
        return hold.size >= FOOT_SHARE * usual
    return 0 < hold.size < SMALL * usual


def route_facts(holds: Sequence[Hold], hands: Sequence[Hold]) -> dict[str, Any]:
    """Figures of a route.

    Returns
    -------
    length : polyline through the hand holds from bottom to top.
    steepness_deg : mean wall angle under its holds.
    steepness_profile : [height above the lowest hold in metres, degrees] per hand hold.
    largest_move : longest distance from a hand hold to the nearest lower one.
    holds_by_type : type to count.
    """
    points = np.array([hold.position for hold in hands]).reshape(-1, 3)
    steps = np.linalg.norm(np.diff(points, axis=0), axis=1)
    reach = [
        float(np.linalg.norm(points[:k] - points[k], axis=1).min()) for k in range(1, len(points))
    ]
    base = min(hold.position[2] for hold in holds)
    return {
        "length": round(float(steps.sum()), 3),
        "steepness_deg": round(float(np.mean([hold.steepness_deg for hold in holds])), 1),
        "steepness_profile": tuple(
            (round(hold.position[2] - base, 3), round(hold.steepness_deg, 1)) for hold in hands
        ),
        "largest_move": round(max(reach, default=0.0), 3),
        "holds_by_type": dict(sorted(Counter(hold.type for hold in holds).items())),
    }


def memberships(links: Floats, group: Ints) -> Floats:
    """How well each hold would fit each group.

    Parameters
    ----------
    links : (n, n) similarity in [0, 1]; group : (n,) group numbers, -1 = none.

    Returns
    -------
    (n, groups) float64, rows sum to 1 (or 0 for holds without any link): squared mean of a
    hold's strongest links into each group, normalised. Squared, so that a hold in the midst
    of its route is not called ambiguous because of a far neighbour.
    """
    count = int(group.max(initial=-1)) + 1
    fit = np.zeros((len(group), count))
    for number in range(count):
        columns = links[:, group == number]
        kept = min(STRONGEST, columns.shape[1])
        fit[:, number] = (np.sort(columns, axis=1)[:, -kept:].sum(axis=1) / STRONGEST) ** 2
    total = fit.sum(axis=1, keepdims=True)
    return np.divide(fit, total, out=np.zeros_like(fit), where=total > 0)


def usual_size(holds: Sequence[Hold]) -> float:
    """The median size of a scan's holds, by which a foothold is small; 0 where none is known."""
    sizes = [hold.size for hold in holds if hold.role == "hold" and hold.size > 0]
    return float(np.median(sizes)) if sizes else 0.0


def ceiling_of(holds: Sequence[Hold]) -> float:
    """Height of a scan's highest hold."""
    return max((hold.position[2] for hold in holds if hold.role == "hold"), default=-np.inf)


def colour_of(holds: Sequence[Hold]) -> tuple[str, Rgb]:
    """The colour that most of the holds have, and what it looks like: the median of theirs."""
    names = [hold.colour for hold in holds]
    name = max(sorted(set(names)), key=names.count)
    paints = [hold.colour_rgb for hold in holds if hold.colour == name]
    red, green, blue = np.median(paints, axis=0).round().astype(int).tolist()
    return name, (red, green, blue)


def describe_route(
    number: int,
    holds: Sequence[Hold],
    usual: float,
    ambiguous: Mapping[int, Mapping[int, float]] | None = None,
    roles: Mapping[int, RoleName] | None = None,
    ceiling: float = -np.inf,
) -> Route:
    """The route of a group of holds: ordered, with its start, top, footholds and facts.

    Footholds are holds typed so, or of unknown type and far smaller than the usual hold;
    where a route has nothing else, all its holds count as hand holds.

    Parameters
    ----------
    usual : `usual_size` of the scan.
    ambiguous : hold id to its probability by route id.
    roles : what a setter says of a hold, also of volumes, which are not among `holds`. Each entry
        is about its own hold: what is found for the others stays.
    ceiling : height of the scan's highest hold.
    """
    said = roles or {}
    ordered = bottom_to_top(holds)
    found = _found_roles(ordered, usual)
    known = [hold.id for hold in ordered]
    known += [hold for hold in said if hold not in known]

    def having(role: RoleName) -> tuple[int, ...]:
        return tuple(
            hold for hold in known if said.get(hold) == role or hold in found[role] - said.keys()
        )

    feet = having("foot")
    hands = [hold for hold in ordered if hold.id not in feet] or ordered
    colour, rgb = colour_of(ordered)
    sure = [hold for hold in ordered if hold.id not in found["foot"]]
    doubtful_start = _doubtful_start(ordered, sure, usual, ambiguous or {})
    doubtful_top = _doubtful_top(ordered, sure, usual, ambiguous or {}, ceiling)
    return Route(
        id=number,
        colour=colour,
        colour_rgb=rgb,
        holds=tuple(hold.id for hold in ordered),
        start=having("start"),
        top=having("top"),
        zone=having("zone"),
        footholds=feet,
        doubtful_start="" if "start" in said.values() else doubtful_start,
        doubtful_top="" if "top" in said.values() else doubtful_top,
        ambiguous=tuple(
            Ambiguous(hold, {str(route): round(p, 3) for route, p in shares.items()})
            for hold, shares in (ambiguous or {}).items()
        ),
        **route_facts(ordered, hands),
    )


def _found_roles(ordered: Sequence[Hold], usual: float) -> dict[RoleName, set[int]]:
    """Ids of start, top and footholds of holds from bottom to top."""
    feet = {hold.id for hold in ordered if _is_foothold(hold, usual)}
    hands = [hold for hold in ordered if hold.id not in feet]
    if not hands:
        feet, hands = set(), list(ordered)
    start = {hold.id for hold in _start(hands)}
    return {"start": start, "top": {hands[-1].id}, "foot": feet, "zone": set()}

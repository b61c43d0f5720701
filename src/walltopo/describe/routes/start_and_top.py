"""Start and top of a route: which holds, and how likely they are the right ones.

The start is the two lowest hand holds, or the lowest alone where it has room for both hands and the
next is far up; the top is the highest. Two logistic regressions say how likely start and top are
right, on cues that are 0 where nothing speaks against them and never speak for them. Ends below
`SURE` are flagged, with the cue that weighs most in words.

Fitted to simulated scans of generated gyms by `python -m walltopo_lab.benchmarks.starts fit`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import FLAT, UNKNOWN, Doubtful, Hold

Floats = NDArray[np.float64]

# Why an end may be wrong, by cue.
START_REASONS = {
    "feet": "a hold at the start may be for the feet, or for the hands",
    "height": "it starts higher than other routes: a hold may have been missed",
    "low": "it starts lower than other routes: a hold may be for the feet, or of another route",
    "gap": "it is far to the next hold: one may have been missed",
    "pair": "one start hold or two",
    "stray": "a hold of its colour near the start is not in it",
    "rival": "a start hold may be of another route",
    "few": "it has few holds: some may have been missed",
}
TOP_REASONS = {
    "feet": "a hold at the top may be for the feet, or for the hands",
    "height": "it ends lower than other routes: a hold may have been missed",
    "gap": "it is far to the hold below: the top may be of another route",
    "pair": "two holds are about as high",
    "stray": "a hold of its colour near the top is not in it",
    "few": "it has few holds: some may have been missed",
}
START_WEIGHTS = {
    "feet": -3.301,
    "height": -3.048,
    "low": -1.726,
    "gap": -0.753,
    "pair": -0.312,
    "stray": -1.556,
    "rival": -4.594,
    "few": -2.783,
}
START_BIAS = 2.881
TOP_WEIGHTS = {
    "feet": -5.343,
    "height": -4.828,
    "gap": -0.985,
    "pair": -2.264,
    "stray": -4.027,
    "few": -2.783,
}
TOP_BIAS = 4.202
SURE = 0.8  # ends that are less likely right are flagged

RISE = 1.6  # of a route's median rise: a second start hold higher by more is no start
LEVEL = 0.5  # of a route's median rise: two holds at the top that differ by less may be confused
BESIDE = 0.5  # of a route's median rise: so far beyond an end a hold may still be one
RHYTHM = 4  # rises that a route must have for its own median to count, not the wall's
NEAR = 2.0  # of a typical move: a stray hold this near to an end may be one
MOST = 3.0  # where cues end: beyond it more says no more
STRAY_SIZES = (0.3, 2.0)  # of the usual hold: what a stray must measure to be a hold


@dataclass(frozen=True, eq=False)
class Wall:
    """What is usual on a wall, for one of its routes to be compared with.

    Parameters
    ----------
    usual : median size of its holds, 0 where none is known.
    rise, move : median difference in height, and median distance, from hand hold to hand hold.
    bottom, top : median heights of the routes' lowest and highest hand holds.
    hands : median number of a route's hand holds.
    strays : what may be a hold and is in no route.
    """

    usual: float
    rise: float = 0.0
    move: float = 0.0
    bottom: float = 0.0
    top: float = 0.0
    hands: float = 0.0
    strays: tuple[Hold, ...] = ()

    def beside(self, free: Iterable[Hold], left_out: Iterable[Doubtful]) -> Wall:
        """The same wall with its holds of no route, and with what was left out.

        What lies flat on the wall, or is far smaller or larger than holds are, is no hold.
        """
        low, high = (share * self.usual for share in STRAY_SIZES)
        spare = (row.hold for row in left_out if row.reason != FLAT)
        kept = (hold for hold in spare if low < hold.size < high)
        return replace(self, strays=(*(hold for hold in free if hold.role == "hold"), *kept))


@dataclass(frozen=True)
class Doubt:
    """What speaks against an end of a route.

    Parameters
    ----------
    cues : name to how strong it is, 0 where it says nothing.
    sure : how likely the end is right; reason : why it may be another, empty where that is enough.
    """

    cues: Mapping[str, float]
    sure: float
    reason: str

    @classmethod
    def of(
        cls,
        cues: Mapping[str, float],
        weights: Mapping[str, float],
        bias: float,
        reasons: Mapping[str, str],
    ) -> Doubt:
        """By a regression."""
        against = {name: weights[name] * cue for name, cue in cues.items()}
        sure = float(1 / (1 + np.exp(-sum(against.values()) - bias)))
        worst = min(against, key=lambda name: against[name])
        return cls(cues, sure, reasons[worst] if sure < SURE else "")


@dataclass(frozen=True, eq=False)
class Ends:
    """Start, top and footholds of a route, and what speaks against its ends.

    Parameters
    ----------
    start : one or two of its hand holds; feet : its holds that are not for hands.
    """

    start: tuple[Hold, ...]
    top: Hold
    feet: tuple[Hold, ...]
    start_doubt: Doubt
    top_doubt: Doubt


def wall_of(routes: Sequence[Sequence[Hold]], holds: Sequence[Hold]) -> Wall:
    """What is usual on a wall, by the holds of each route and by all of the scan."""
    sizes = [hold.size for hold in holds if hold.role == "hold" and hold.size > 0]
    usual = float(np.median(sizes)) if sizes else 0.0
    hands = [split_hands(bottom_to_top(route), usual)[0] for route in routes]
    if not hands:
        return Wall(usual)
    return Wall(
        usual=usual,
        rise=_median(np.concatenate([rises_of(one) for one in hands])),
        move=_median(np.concatenate([_moves(one) for one in hands])),
        bottom=float(np.median([one[0].position[2] for one in hands])),
        top=float(np.median([one[-1].position[2] for one in hands])),
        hands=float(np.median([len(one) for one in hands])),
    )


def _median(values: Floats) -> float:
    return float(np.median(values)) if len(values) else 0.0


def _moves(hands: Sequence[Hold]) -> Floats:
    points = np.array([hold.position for hold in hands], dtype=np.float64).reshape(-1, 3)
    return np.asarray(np.linalg.norm(np.diff(points, axis=0), axis=1))


def find_ends(
    holds: Sequence[Hold], wall: Wall, ambiguous: Mapping[int, Mapping[int, float]], number: int
) -> Ends:
    """Start, top and footholds of the holds of one route, not empty.

    Parameters
    ----------
    ambiguous : hold id to its probability by route id; number : of this route.
    """
    ordered = bottom_to_top(holds)
    hands, feet = split_hands(ordered, wall.usual)
    rises = rises_of(hands)
    rise = _median(rises) if len(rises) >= RHYTHM else wall.rise
    start = _start(hands, wall, rise)
    rivals = [
        share
        for hold in start
        for route, share in ambiguous.get(hold.id, {}).items()
        if route != number
    ]
    low = start[-1].position[2] + BESIDE * rise
    high = hands[-1].position[2] - BESIDE * rise
    strays = [stray for stray in wall.strays if stray.colour in {hold.colour for hold in ordered}]
    first, last = (rises[0], rises[-1]) if len(rises) else (rise, rise)
    few = max(0.0, 1 - len(hands) / max(wall.hands, 1.0))
    start_cues = {
        "feet": _mistaken([hold for hold in ordered if hold.position[2] <= low], wall),
        "height": _share(hands[0].position[2] - wall.bottom, wall.rise),
        "low": _share(wall.bottom - hands[0].position[2], wall.rise),
        "gap": _share(first - rise, rise),
        "pair": _one_or_two(hands, wall, first, rise),
        "stray": _stray([stray for stray in strays if stray.position[2] <= low], start, wall),
        "rival": max(rivals, default=0.0),
        "few": few,
    }
    top_cues = {
        "feet": _mistaken([hold for hold in ordered if hold.position[2] >= high], wall),
        "height": _share(wall.top - hands[-1].position[2], wall.rise),
        "gap": _share(last - rise, rise),
        "pair": 1 - min(1.0, _share(last, LEVEL * rise)) if len(rises) else 0.0,
        "stray": _stray([stray for stray in strays if stray.position[2] >= high], hands[-1:], wall),
        "few": few,
    }
    return Ends(
        start,
        hands[-1],
        tuple(feet),
        Doubt.of(start_cues, START_WEIGHTS, START_BIAS, START_REASONS),
        Doubt.of(top_cues, TOP_WEIGHTS, TOP_BIAS, TOP_REASONS),
    )


def _roomy(hold: Hold, wall: Wall) -> bool:
    """Whether both hands find room on a hold, or its size is not known."""
    return hold.size == 0 or hold.size >= wall.usual


def _start(hands: Sequence[Hold], wall: Wall, rise: float) -> tuple[Hold, ...]:
    """The start among the hand holds, from bottom to top; one must be left for the top."""
    if len(hands) < 3:
        return tuple(hands[:1])
    alone = _roomy(hands[0], wall) and rises_of(hands[:2])[0] > RISE * rise
    return (hands[0],) if alone else (hands[0], hands[1])


def _one_or_two(hands: Sequence[Hold], wall: Wall, first: float, rise: float) -> float:
    """How near the first rise is to where a second start hold becomes none: 1 there, 0 far off."""
    if len(hands) < 3 or rise <= 0 or not _roomy(hands[0], wall):
        return 0.0
    return max(0.0, 1 - abs(first / rise - RISE))


def _mistaken(holds: Sequence[Hold], wall: Wall) -> float:
    """How many of the holds are expected to be for feet where hands were taken, or the reverse."""
    likely = hand_probability(holds, wall.usual)
    return float(np.minimum(likely, 1 - likely).sum())


def _share(length: float, unit: float) -> float:
    """A length in units, from 0 to `MOST`; 0 without a unit."""
    return float(np.clip(length / unit, 0.0, MOST)) if unit > 0 else 0.0


def _stray(strays: Sequence[Hold], end: Sequence[Hold], wall: Wall) -> float:
    """How near the nearest stray hold is to an end: 1 at it, 0 from `NEAR` on."""
    if not strays or wall.move <= 0:
        return 0.0
    there, here = (np.array([hold.position for hold in some]) for some in (strays, end))
    nearest = np.linalg.norm(there[:, None] - here[None], axis=2).min()
    return float(np.clip(1 - nearest / (NEAR * wall.move), 0.0, 1.0))


# For hands rather than feet: how sure a hold is a foothold by its type, how sure it is of another
# type, and the logarithm of its size against the wall's usual hold.
HAND_WEIGHTS = (-3.977, 1.626, 6.6)


HAND_BIAS = 4.893


SHARES = (0.2, 5.0)  # of the usual hold: beyond them a size says no more


def hand_cues(holds: Sequence[Hold], usual: float) -> Floats:
    """(n, 3) what tells hand holds from footholds; see `HAND_WEIGHTS`.

    Parameters
    ----------
    usual : median size of the wall's holds; where it or a size is 0, size says nothing.
    """
    sure = np.array([hold.type_confidence if hold.type != UNKNOWN else 0.0 for hold in holds])
    foot = np.array([hold.type == "foothold" for hold in holds])
    share = [hold.size / usual if usual > 0 and hold.size > 0 else 1.0 for hold in holds]
    return np.column_stack([sure * foot, sure * ~foot, np.log(np.clip(share, *SHARES))])


def hand_probability(holds: Sequence[Hold], usual: float) -> Floats:
    """(n,) how likely each hold is for hands."""
    odds = hand_cues(holds, usual) @ np.array(HAND_WEIGHTS) + HAND_BIAS
    return np.asarray(1 / (1 + np.exp(-odds)))


def split_hands(ordered: Sequence[Hold], usual: float) -> tuple[list[Hold], list[Hold]]:
    """Hand holds and footholds, in the order given; where nothing is for hands, all is."""
    likely = hand_probability(ordered, usual) >= 0.5
    hands = [hold for hold, hand in zip(ordered, likely, strict=True) if hand]
    feet = [hold for hold, hand in zip(ordered, likely, strict=True) if not hand]
    return (hands, feet) if hands else (list(ordered), [])


def bottom_to_top(holds: Sequence[Hold]) -> list[Hold]:
    """Holds by height, ties by id."""
    return sorted(holds, key=lambda hold: (hold.position[2], hold.id))


def rises_of(ordered: Sequence[Hold]) -> Floats:
    """(n - 1,) differences in height from hold to hold."""
    return np.diff(np.array([hold.position[2] for hold in ordered], dtype=np.float64))

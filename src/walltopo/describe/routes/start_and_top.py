"""Find the start and top of a route, with a confidence for each.

The start is the two lowest hand holds. It is the lowest alone if that has room for both hands and
the next hold is far up. The top is the highest hand hold. Two logistic regressions estimate how
likely start and top are right. Every cue is evidence against an end, and 0 without such evidence.
Ends below `MIN_CONFIDENCE` are flagged, with the reason of the cue that weighs most.

Fitted to simulated scans of generated gyms by `python -m benchmarks.starts fit`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.holds import FLAT, UNKNOWN, Hold

Floats = NDArray[np.float64]

# The reason why a start or top may be wrong, by cue.
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
MIN_CONFIDENCE = 0.8  # ends below this are flagged

RISE = 1.6  # of a route's median rise: a second hold higher than this is no start hold
LEVEL = 0.5  # of a route's median rise: two top holds that differ by less may be confused
BESIDE = 0.5  # of a route's median rise: range beyond an end in which a hold may be start or top
RHYTHM = 4  # minimum number of rises for a route's own median to replace the wall's
NEAR = 2.0  # of a typical move: a stray hold this near to an end may belong to it
MAX_CUE = 3.0  # cues are clipped here
STRAY_SIZES = (0.3, 2.0)  # of the median hold size: range in which a stray may be a hold


@dataclass(frozen=True, eq=False)
class WallStats:
    """The usual figures of a wall, with which its routes are compared.

    Parameters
    ----------
    usual : median size of its holds, 0 if unknown.
    rise, move : median difference in height, and median distance, from hand hold to hand hold.
    bottom, top : median heights of the routes' lowest and highest hand holds.
    hands : median number of a route's hand holds.
    strays : possible holds that are in no route.
    """

    usual: float
    rise: float = 0.0
    move: float = 0.0
    bottom: float = 0.0
    top: float = 0.0
    hands: float = 0.0
    strays: tuple[Hold, ...] = ()

    def with_strays(self, free: Iterable[Hold], left_out: Iterable[Hold]) -> WallStats:
        """Return the wall with its holds of no route and its low-confidence instances.

        Instances flat on the wall, or far smaller or larger than holds, are excluded.
        """
        low, high = (share * self.usual for share in STRAY_SIZES)
        spare = (hold for hold in left_out if hold.left_out != FLAT)
        kept = (hold for hold in spare if low < hold.size < high)
        return replace(self, strays=(*(hold for hold in free if hold.role == "hold"), *kept))


@dataclass(frozen=True)
class EndConfidence:
    """The confidence in the start or top of a route.

    Parameters
    ----------
    cues : name to strength, 0 if the cue does not speak against the end.
    confidence : probability that the end is right.
    reason : why it may be another hold, empty if the confidence suffices.
    """

    cues: Mapping[str, float]
    confidence: float
    reason: str

    @classmethod
    def of(
        cls,
        cues: Mapping[str, float],
        weights: Mapping[str, float],
        bias: float,
        reasons: Mapping[str, str],
    ) -> EndConfidence:
        """Compute the confidence by a logistic regression."""
        against = {name: weights[name] * cue for name, cue in cues.items()}
        confidence = float(1 / (1 + np.exp(-sum(against.values()) - bias)))
        worst = min(against, key=lambda name: against[name])
        return cls(cues, confidence, reasons[worst] if confidence < MIN_CONFIDENCE else "")


@dataclass(frozen=True, eq=False)
class StartAndTop:
    """Start, top and footholds of a route, with the confidence in start and top.

    Parameters
    ----------
    start : one or two hand holds; feet : the footholds.
    """

    start: tuple[Hold, ...]
    top: Hold
    feet: tuple[Hold, ...]
    start_confidence: EndConfidence
    top_confidence: EndConfidence


def wall_stats(routes: Sequence[Sequence[Hold]], holds: Sequence[Hold]) -> WallStats:
    """Return the usual figures of a wall, from the holds of each route and of the whole scan."""
    sizes = [hold.size for hold in holds if hold.role == "hold" and hold.size > 0]
    usual = float(np.median(sizes)) if sizes else 0.0
    hands = [split_hands(bottom_to_top(route), usual)[0] for route in routes]
    if not hands:
        return WallStats(usual)
    return WallStats(
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


def find_start_and_top(
    holds: Sequence[Hold],
    wall: WallStats,
    ambiguous: Mapping[int, Mapping[int, float]],
    number: int,
) -> StartAndTop:
    """Return start, top and footholds of the holds of one route, which must not be empty.

    Parameters
    ----------
    ambiguous : hold id to its probability by route id; number : of this route.
    """
    ordered = bottom_to_top(holds)
    hands, feet = split_hands(ordered, wall.usual)
    rises = rises_of(hands)
    rise = _median(rises) if len(rises) >= RHYTHM else wall.rise
    start = _choose_start(hands, wall, rise)
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
        "feet": _expected_mistakes([hold for hold in ordered if hold.position[2] <= low], wall),
        "height": _relative_length(hands[0].position[2] - wall.bottom, wall.rise),
        "low": _relative_length(wall.bottom - hands[0].position[2], wall.rise),
        "gap": _relative_length(first - rise, rise),
        "pair": _near_start_limit(hands, wall, first, rise),
        "stray": _stray_nearness(
            [stray for stray in strays if stray.position[2] <= low], start, wall
        ),
        "rival": max(rivals, default=0.0),
        "few": few,
    }
    top_cues = {
        "feet": _expected_mistakes([hold for hold in ordered if hold.position[2] >= high], wall),
        "height": _relative_length(wall.top - hands[-1].position[2], wall.rise),
        "gap": _relative_length(last - rise, rise),
        "pair": 1 - min(1.0, _relative_length(last, LEVEL * rise)) if len(rises) else 0.0,
        "stray": _stray_nearness(
            [stray for stray in strays if stray.position[2] >= high], hands[-1:], wall
        ),
        "few": few,
    }
    return StartAndTop(
        start,
        hands[-1],
        tuple(feet),
        EndConfidence.of(start_cues, START_WEIGHTS, START_BIAS, START_REASONS),
        EndConfidence.of(top_cues, TOP_WEIGHTS, TOP_BIAS, TOP_REASONS),
    )


def _fits_both_hands(hold: Hold, wall: WallStats) -> bool:
    """Return whether both hands fit on a hold, or its size is unknown."""
    return hold.size == 0 or hold.size >= wall.usual


def _choose_start(hands: Sequence[Hold], wall: WallStats, rise: float) -> tuple[Hold, ...]:
    """Return the start among the hand holds, from bottom to top; leave one hold for the top."""
    if len(hands) < 3:
        return tuple(hands[:1])
    alone = _fits_both_hands(hands[0], wall) and rises_of(hands[:2])[0] > RISE * rise
    return (hands[0],) if alone else (hands[0], hands[1])


def _near_start_limit(hands: Sequence[Hold], wall: WallStats, first: float, rise: float) -> float:
    """Return how near the first rise is to the limit of a second start hold: 1 at it, 0 far off."""
    if len(hands) < 3 or rise <= 0 or not _fits_both_hands(hands[0], wall):
        return 0.0
    return max(0.0, 1 - abs(first / rise - RISE))


def _expected_mistakes(holds: Sequence[Hold], wall: WallStats) -> float:
    """Return the expected number of holds misclassified as hand hold or foothold."""
    likely = hand_probability(holds, wall.usual)
    return float(np.minimum(likely, 1 - likely).sum())


def _relative_length(length: float, unit: float) -> float:
    """Return a length as a multiple of `unit`, clipped to 0..`MAX_CUE`; 0 if `unit` is 0."""
    return float(np.clip(length / unit, 0.0, MAX_CUE)) if unit > 0 else 0.0


def _stray_nearness(strays: Sequence[Hold], end: Sequence[Hold], wall: WallStats) -> float:
    """Return how near the nearest stray hold is to an end: 1 at it, 0 from `NEAR` on."""
    if not strays or wall.move <= 0:
        return 0.0
    there, here = (np.array([hold.position for hold in some]) for some in (strays, end))
    nearest = np.linalg.norm(there[:, None] - here[None], axis=2).min()
    return float(np.clip(1 - nearest / (NEAR * wall.move), 0.0, 1.0))


# Regression of hand hold against foothold: type confidence of a foothold, type confidence of
# another type, and logarithm of the size over the wall's median size.
HAND_WEIGHTS = (-3.977, 1.626, 6.6)

HAND_BIAS = 4.893

SIZE_RANGE = (0.2, 5.0)  # of the wall's median size; sizes are clipped to this range


def hand_cues(holds: Sequence[Hold], usual: float) -> Floats:
    """Return the (n, 3) features that separate hand holds from footholds; see `HAND_WEIGHTS`.

    Parameters
    ----------
    usual : median size of the wall's holds; if it or a size is 0, the size cue is 0.
    """
    known = np.array([hold.type_confidence if hold.type != UNKNOWN else 0.0 for hold in holds])
    foot = np.array([hold.type == "foothold" for hold in holds])
    share = [hold.size / usual if usual > 0 and hold.size > 0 else 1.0 for hold in holds]
    return np.column_stack([known * foot, known * ~foot, np.log(np.clip(share, *SIZE_RANGE))])


def hand_probability(holds: Sequence[Hold], usual: float) -> Floats:
    """Return (n,) the probability that each hold is a hand hold."""
    odds = hand_cues(holds, usual) @ np.array(HAND_WEIGHTS) + HAND_BIAS
    return np.asarray(1 / (1 + np.exp(-odds)))


def split_hands(ordered: Sequence[Hold], usual: float) -> tuple[list[Hold], list[Hold]]:
    """Return hand holds and footholds, in the order given; if all are footholds, all are hands."""
    likely = hand_probability(ordered, usual) >= 0.5
    hands = [hold for hold, hand in zip(ordered, likely, strict=True) if hand]
    feet = [hold for hold, hand in zip(ordered, likely, strict=True) if not hand]
    return (hands, feet) if hands else (list(ordered), [])


def bottom_to_top(holds: Sequence[Hold]) -> list[Hold]:
    """Return the holds by height, then by id."""
    return sorted(holds, key=lambda hold: (hold.position[2], hold.id))


def rises_of(ordered: Sequence[Hold]) -> Floats:
    """Return (n - 1,) differences in height from hold to hold."""
    return np.diff(np.array([hold.position[2] for hold in ordered], dtype=np.float64))

"""Describe a climb by numbers that are independent of its wall: the input of the grade model.

Lengths are shares of the body's height; efforts are those of `walltopo_climb.movement.statics`.
Each feature has the sign of its effect on the grade if that is beyond doubt (+1: never easier).
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from walltopo_climb.movement.sequence import LIMBS, Climb, Sequence
from walltopo_climb.movement.statics import NONE

HANDS, FEET = LIMBS[:2], LIMBS[2:]

# Name to sign.
FEATURES: dict[str, int] = {
    "hand_moves": 0,
    "foot_moves": 0,
    "cuts": 0,
    "effort_sum": 0,
    "effort_mean": 1,
    "effort_crux": 1,
    "effort_second": 1,
    "effort_third": 1,
    "effort_feet": 0,
    "effort_start": 0,
    "leaps": 1,
    "leap_most": 1,
    "leap_sum": 1,
    "way_most": 1,
    "way_mean": 1,
    "sideways_most": 0,
    "crux_at": 0,
    "climbed": 0,
    "holds": -1,
    "holds_a_height": -1,
    "unused": 0,
    "gap_most": 1,
    "gap_mean": 1,
    "spread": 0,
    "low_holds": 0,
    "steepness": 0,
    "quality_mean": -1,
    "quality_least": -1,
    "quality_second": -1,
    "quality_used": -1,
}


def features(climb: Climb, sequence: Sequence, known: bool) -> npt.NDArray[np.float32]:
    """Return the features of a climb in the order of `FEATURES`; NaN if unknown.

    Parameters
    ----------
    sequence : the moves of `ADULT`, with whom the model is trained.
    known : whether the quality of the holds (type and size) is known, or only their positions.
    """
    values = {
        **_of_moves(climb, sequence),
        **_of_holds(climb, sequence),
        **_quality_features(climb, sequence, known),
    }
    return np.array([values[name] for name in FEATURES], np.float32)


def _of_moves(climb: Climb, sequence: Sequence) -> dict[str, float]:
    height = sequence.body.height
    position = climb.grips.position
    hands: list[float] = []
    feet: list[float] = []
    ways: list[float] = []
    sideways: list[float] = []
    cuts = 0
    for before, move in zip(sequence.moves[:-1], sequence.moves[1:], strict=True):
        assert move.limb is not None
        limb = LIMBS.index(move.limb)
        cuts += move.to == NONE
        (hands if limb < 2 else feet).append(move.effort)
        if limb < 2:
            step = position[move.to] - position[before.limbs[limb]]
            ways.append(float(np.linalg.norm(step)) / height)
            sideways.append(float(np.linalg.norm(step[:2])) / height)
    hardest = sorted(hands, reverse=True) + [0.0] * 3
    leaps = [move.beyond / height for move in sequence.moves if move.beyond > 0]
    return {
        "hand_moves": len(hands),
        "foot_moves": len(feet),
        "cuts": cuts,
        "effort_sum": sum(hands) + sum(feet),
        "effort_mean": sum(hands) / max(len(hands), 1),
        "effort_crux": hardest[0],
        "effort_second": hardest[1],
        "effort_third": hardest[2],
        "effort_feet": max(feet, default=0.0),
        "effort_start": sequence.moves[0].effort,
        "leaps": len(leaps),
        "leap_most": max(leaps, default=0.0),
        "leap_sum": sum(leaps),
        "way_most": max(ways, default=0.0),
        "way_mean": sum(ways) / max(len(ways), 1),
        "sideways_most": max(sideways, default=0.0),
        "crux_at": sequence.crux / max(len(sequence.moves) - 1, 1),
    }


def _of_holds(climb: Climb, sequence: Sequence) -> dict[str, float]:
    height = sequence.body.height
    grips = climb.grips
    hands = grips.hand > 0
    position = grips.position[hands] / height
    used = {move.limbs[k] for move in sequence.moves for k in range(2)}
    order = np.argsort(position[:, 2], kind="stable")
    gaps = (
        np.linalg.norm(np.diff(position[order], axis=0), axis=1) if len(order) > 1 else np.zeros(1)
    )
    tall = float(np.ptp(position[:, 2]))
    up = grips.wall[hands].mean(axis=0)[2]
    return {
        "climbed": tall,
        "holds": int(hands.sum()),
        "holds_a_height": int(hands.sum()) / max(tall, 0.3),
        "unused": int(hands.sum()) - len(used),
        "gap_most": float(gaps.max()),
        "gap_mean": float(gaps.mean()),
        "spread": float(np.linalg.norm(position[:, :2].std(axis=0))),
        "low_holds": int((position[:, 2] < position[:, 2].min() + 0.4).sum()),
        "steepness": math.degrees(math.asin(max(-1.0, min(1.0, -float(up))))),
    }


def _quality_features(climb: Climb, sequence: Sequence, known: bool) -> dict[str, float]:
    hand = climb.grips.hand
    names = ("quality_mean", "quality_least", "quality_second", "quality_used")
    if not known:
        return dict.fromkeys(names, math.nan)
    graspable = np.sort(hand[hand > 0])
    used = sorted({i for move in sequence.moves for i in move.limbs[:2]})
    values = (
        graspable.mean(),
        graspable[0],
        graspable[min(1, len(graspable) - 1)],
        hand[used].mean(),
    )
    return {name: float(value) for name, value in zip(names, values, strict=True)}

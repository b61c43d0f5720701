"""Hand holds and footholds of a route: told apart by type and size.

A logistic regression, fitted to simulated scans of generated gyms by
`python -m walltopo_lab.benchmarks.starts fit`.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import UNKNOWN, Hold

__all__ = ["bottom_to_top", "hand_cues", "hand_probability", "rises_of", "split_hands"]

Floats = NDArray[np.float64]

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

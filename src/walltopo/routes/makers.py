"""Holds of one colour that touch but come from different sets: a weight on their similarity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.attributes import Hold

__all__ = ["kinship"]


def kinship(holds: Sequence[Hold], pairs: NDArray[np.int64], weight: float) -> NDArray[np.float64]:
    """(P,) factors in [0, 1] on the similarity of pairs: 1 - `weight` where makers differ.

    A setter takes a route from one or two sets. A maker that is not known differs from none.

    Parameters
    ----------
    pairs : (P, 2) numbers of holds; weight : `routes.maker_weight`.
    """
    names = np.array([hold.maker for hold in holds], dtype=object)
    one, two = names[pairs[:, 0]], names[pairs[:, 1]]
    differ = (one != "") & (two != "") & (one != two)
    return np.where(differ.astype(np.bool_), 1.0 - weight, 1.0)

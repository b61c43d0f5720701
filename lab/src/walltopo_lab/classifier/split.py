"""Split of labelled cutouts into training and held-out holds."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.classifier.samples import Cutouts


def hold_split(cutouts: Cutouts, share: float, seed: int) -> NDArray[np.bool_]:
    """Return (n,) whether a cutout is held out: whole holds, the same share of every class.

    Raises
    ------
    InputError : a class has fewer than two holds; one each is needed for training and validation.
    """
    rng = np.random.default_rng(seed)
    held = np.zeros(len(cutouts.label), dtype=np.bool_)
    for number, name in enumerate(cutouts.names):
        holds = rng.permutation(np.unique(cutouts.hold[cutouts.label == number]))
        if len(holds) < 2:
            raise InputError(
                f"class {name!r} has one hold only",
                "Every class needs two or more; merge it with another or leave it out.",
            )
        count = min(max(1, round(share * len(holds))), len(holds) - 1)
        held |= np.isin(cutouts.hold, holds[:count])
    return held

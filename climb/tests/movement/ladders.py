"""Climbs made by hand."""

from __future__ import annotations

import numpy as np

from walltopo_climb.movement.grips import Grips, best_pull, foot_share
from walltopo_climb.movement.sequence import Climb


def ladder(
    rungs: int = 8,
    rise: float = 0.4,
    steepness_deg: float = 0.0,
    quality: float = 0.9,
    apart: float = 0.2,
) -> Climb:
    """Holds left and right in turn, from 0.4 m up; the last is the top, the first two the start."""
    lean = np.radians(steepness_deg)
    along = 0.4 + rise * np.arange(rungs)
    side = np.where(np.arange(rungs) % 2, apart, -apart)
    position = np.stack([side, -along * np.sin(lean), along * np.cos(lean)], axis=1)
    wall = np.tile([0.0, -np.cos(lean), -np.sin(lean)], (rungs, 1))
    grips = Grips(
        position=position,
        wall=wall,
        pull=best_pull(wall, wall),
        hand=np.full(rungs, quality),
        outward=np.full(rungs, 0.2),
        foot=foot_share(np.full(rungs, steepness_deg)),
    )
    return Climb(grips, (2, 3), (rungs - 1,))

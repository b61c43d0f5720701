"""Settings of the lift. Light: importing it loads no numerics."""

from __future__ import annotations

import math
from dataclasses import dataclass

from walltopo.core.setting import check_settings, setting

__all__ = ["LiftParams", "length_of_share"]


def length_of_share(share: float, mean_distance: float) -> float:
    """A length from its normalised form: tan(π/2 · share) · mean camera-to-object distance."""
    return math.tan(math.pi / 2 * share) * mean_distance


@dataclass(frozen=True)
class LiftParams:
    """How 2D masks become 3D instances."""

    normalised: bool = setting(
        False, "take lengths from their normalised form (for scans without a scale)"
    )
    visibility_distance: float = setting(
        8.0, "triangles farther from a camera than this are not seen", unit="m", low=1e-9
    )
    visibility_share: float = setting(
        0.76,
        "the same, normalised: tan(pi/2 n) times the mean camera-to-object distance",
        low=1e-6,
        high=0.999999,
    )
    easing_power: float = setting(
        0.0,
        "how a score falls with distance: (1 - distance/visibility) ** 4**power",
        low=-1.0,
        high=1.0,
    )
    mask_resolution: int = setting(
        0, "longer side of the label image, 0 = that of the masks", unit="px", low=0, high=65536
    )
    cell_resolution: float = setting(
        0.1, "cell of the spatial hash that finds candidate pairs (reference)", unit="m", low=1e-9
    )
    cell_share: float = setting(
        0.02, "the same, normalised as visibility_share", low=1e-6, high=0.999999
    )
    resolution: float = setting(
        1.0, "Louvain resolution: larger gives more, smaller clusters", low=0.0
    )
    threshold: float = setting(
        0.5, "a triangle is kept at this share of positive evidence", low=0.0, high=1.0
    )
    seed: int = setting(0, "seed of Louvain and of the sampled rays", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "lift")

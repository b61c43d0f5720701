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
    """How 2D masks become 3D instances.

    `method = "literal"` is the published algorithm; `"robust"` (default) is ours: the same
    evidence, other decisions, each of its steps with a switch of its own.
    """

    method: str = setting(
        "robust", "robust, or literal: the published algorithm", choices=("robust", "literal")
    )
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
        0.5,
        "a triangle is kept at this share of positive evidence (published: 0.5)",
        low=0.0,
        high=1.0,
    )
    drop_duplicates: bool = setting(
        True, "robust: of two masks of the same object in one photo keep the surer one"
    )
    drop_fused: bool = setting(
        True, "robust: ignore masks that most other views see as several objects"
    )
    least_overlap: float = setting(
        0.1, "robust: masks overlapping less are not connected", low=0.0, high=1.0
    )
    cohesion: float = setting(
        0.25, "robust: clusters merge at this mean overlap of their masks", low=0.01, high=0.99
    )
    objective: str = setting(
        "potts",
        "robust: what clusters maximise; modularity (by `resolution`) is the published choice",
        choices=("potts", "modularity"),
    )
    rounds: int = setting(
        2, "robust: how often masks are handed to the instance they fit best", low=0, high=20
    )
    split_apart: bool = setting(
        False, "robust: parts of an instance that do not touch on the mesh become instances"
    )
    fill_pinholes: bool = setting(True, "robust: fill small holes inside an instance")
    least_support: float = setting(
        0.15,
        "robust: an instance is dropped if fewer of the views that saw it found it",
        low=0.0,
        high=1.0,
    )
    least_score: float = setting(
        0.0,
        "robust: an instance is dropped if its score (support x mask score x agreement) is lower",
        low=0.0,
        high=1.0,
    )
    border_band: float = setting(
        4.0,
        "robust: how far from a mask's border its evidence is soft",
        unit="px",
        low=0.0,
        high=15.0,
    )
    border_smoothness: float = setting(
        0.0,
        "robust: shorten borders by a graph cut that weighs this x mean edge length x border "
        "against log-odds x area; 0 = off",
        low=0.0,
        high=100.0,
    )
    sample_px: float = setting(
        32.0, "robust: larger triangles get several samples", unit="px", low=0.5
    )
    most_splits: int = setting(
        8, "robust: at most this number squared of samples a triangle", low=1, high=64
    )
    seed: int = setting(0, "seed of Louvain and of the sampled rays", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "lift")

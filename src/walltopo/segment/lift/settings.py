"""Settings of the lift. This module imports no numerics, so that commands start fast."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core.settings import about, check_settings

Method = Literal["robust", "literal"]
OnTop = Literal["small", "surest"]
Confidence = Literal["mean", "sum", "share"]


def length_of_share(share: float, mean_distance: float) -> float:
    """Return a length from its normalised form: tan(π/2 · share) · mean distance to the object."""
    return math.tan(math.pi / 2 * share) * mean_distance


@dataclass(frozen=True)
class LiftParams:
    """Parameters of the lift from 2D masks to 3D instances.

    `method = "literal"` is the published algorithm. `"robust"` (default) is our own: the same
    evidence with other decisions, each of which can be switched off.
    """

    # fmt: off
    method: Annotated[Method, about("robust, or literal: the published algorithm")] = "robust"
    normalised: Annotated[bool, about("Take lengths from their normalised form (for scans without a scale)")] = False
    visibility_distance: Annotated[float, about("Triangles farther from a camera count as unseen", unit="m", low=1e-09, expert=True)] = 8.0
    visibility_share: Annotated[float, about("visibility_distance in normalised form: tan(pi/2 n) times the mean distance", low=1e-06, high=0.999999, expert=True)] = 0.76
    easing_power: Annotated[float, about("Decrease of a score with distance: (1 - distance/visibility) ** 4**power", low=-1.0, high=1.0, expert=True)] = 0.0
    mask_resolution: Annotated[int, about("Longer side of the label image; 0: that of the masks", unit="px", low=0, high=65536, expert=True)] = 0
    resolution: Annotated[float, about("Louvain resolution; larger gives more, smaller clusters", low=0.0, expert=True)] = 1.0
    confidence: Annotated[Confidence, about("literal: score of an instance, from its masks' scores (mean, sum) or its share of positive evidence", expert=True)] = "mean"
    threshold: Annotated[float, about("Minimum share of positive evidence that keeps a triangle", low=0.0, high=1.0)] = 0.5
    on_top: Annotated[OnTop, about("Mask on top where masks of one photo overlap: the smaller one, or the one with the higher score", expert=True)] = "small"
    by_class: Annotated[bool, about("robust: cluster the masks of each class separately, as literal does", expert=True)] = False
    overlap: Annotated[Literal["covisible", "all"], about("robust: compare masks over the faces that both photos saw, or over all (as literal)", expert=True)] = "covisible"
    voters: Annotated[Literal["holders", "all"], about("robust: photos that vote on an instance: those with a mask of it, or all that see it (as literal)", expert=True)] = "holders"
    drop_duplicates: Annotated[bool, about("robust: drop the mask with the lower score if one photo has two masks of an object", expert=True)] = True
    cohesion: Annotated[float, about("robust: minimum mean overlap at which clusters merge", low=0.01, high=0.99, expert=True)] = 0.25
    objective: Annotated[Literal["potts", "modularity"], about("robust: objective of the clustering; modularity (with `resolution`) is the published one", expert=True)] = "potts"
    rounds: Annotated[int, about("robust: number of rounds that reassign masks to the best instance", low=0, high=20, expert=True)] = 2
    fill_pinholes: Annotated[bool, about("robust: fill small holes inside an instance", expert=True)] = True
    min_support: Annotated[float, about("robust: minimum share of the views of an instance that have a mask of it", low=0.0, high=1.0, expert=True)] = 0.15
    border_band: Annotated[float, about("robust: distance from a mask's border within which its evidence is soft", unit="px", low=0.0, high=15.0, expert=True)] = 4.0
    sample_px: Annotated[float, about("robust: triangles larger than this get several samples", unit="px", low=0.5, expert=True)] = 32.0
    max_splits: Annotated[int, about("robust: maximum number of samples per triangle, its square root", low=1, high=64, expert=True)] = 8
    seed: Annotated[int, about("Random seed", low=0, expert=True)] = 0
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "lift")


# The shipped detector's masks are rather too small and miss volumes in many photos. A scan
# therefore keeps more than the defaults, which suit masks with errors in both directions (docs/lift.md).
FOR_DETECTIONS = LiftParams(threshold=0.4, min_support=0.05)

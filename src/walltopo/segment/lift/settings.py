"""Settings of the lift. Light: importing it loads no numerics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core.settings import about, check_settings

Method = Literal["robust", "literal"]
OnTop = Literal["small", "surest"]
Confidence = Literal["mean", "sum", "share"]


def length_of_share(share: float, mean_distance: float) -> float:
    """A length from its normalised form: tan(π/2 · share) · mean camera-to-object distance."""
    return math.tan(math.pi / 2 * share) * mean_distance


@dataclass(frozen=True)
class LiftParams:
    """How 2D masks become 3D instances.

    `method = "literal"` is the published algorithm; `"robust"` (default) is ours: the same
    evidence, other decisions, each of its steps with a switch of its own.
    """

    method: Annotated[Method, about("robust, or literal: the published algorithm")] = "robust"
    normalised: Annotated[
        bool, about("take lengths from their normalised form (for scans without a scale)")
    ] = False
    visibility_distance: Annotated[
        float, about("triangles farther from a camera than this are not seen", unit="m", low=1e-9)
    ] = 8.0
    visibility_share: Annotated[
        float,
        about(
            "the same, normalised: tan(pi/2 n) times the mean camera-to-object distance",
            low=1e-6,
            high=0.999999,
            expert=True,
        ),
    ] = 0.76
    easing_power: Annotated[
        float,
        about(
            "how a score falls with distance: (1 - distance/visibility) ** 4**power",
            low=-1.0,
            high=1.0,
            expert=True,
        ),
    ] = 0.0
    mask_resolution: Annotated[
        int,
        about(
            "longer side of the label image, 0 = that of the masks",
            unit="px",
            low=0,
            high=65536,
            expert=True,
        ),
    ] = 0
    resolution: Annotated[
        float,
        about("Louvain resolution: larger gives more, smaller clusters", low=0.0, expert=True),
    ] = 1.0
    confidence: Annotated[
        Confidence,
        about(
            "literal: what instances are ranked by, which the publication does not tell: mean or "
            "sum of their masks' scores on the mesh, or mean share of positive evidence",
            expert=True,
        ),
    ] = "mean"
    threshold: Annotated[
        float,
        about(
            "a triangle is kept at this share of positive evidence",
            low=0.0,
            high=1.0,
        ),
    ] = 0.5
    on_top: Annotated[
        OnTop,
        about(
            "which mask is drawn on top where those of one photo overlap: the smaller, or the one "
            "with the higher score",
            expert=True,
        ),
    ] = "small"
    by_class: Annotated[
        bool,
        about(
            "robust: cluster the masks of each class apart, as literal does; else a mask of the "
            "wrong class still joins its object",
            expert=True,
        ),
    ] = False
    overlap: Annotated[
        Literal["covisible", "all"],
        about(
            "robust: masks are compared over what both photos saw, or, as in literal, over all "
            "their triangles",
            expert=True,
        ),
    ] = "covisible"
    voters: Annotated[
        Literal["holders", "all"],
        about(
            "robust: who votes on an instance's triangles: photos that hold a mask of it, or, as "
            "in literal, all that see them",
            expert=True,
        ),
    ] = "holders"
    drop_duplicates: Annotated[
        bool,
        about(
            "robust: of two masks of the same object in one photo keep the surer one", expert=True
        ),
    ] = True
    cohesion: Annotated[
        float,
        about(
            "robust: clusters merge at this mean overlap of their masks",
            low=0.01,
            high=0.99,
            expert=True,
        ),
    ] = 0.25
    objective: Annotated[
        Literal["potts", "modularity"],
        about(
            "robust: what clusters maximise; modularity (by `resolution`) is the published choice",
            expert=True,
        ),
    ] = "potts"
    rounds: Annotated[
        int,
        about(
            "robust: how often masks are handed to the instance they fit best",
            low=0,
            high=20,
            expert=True,
        ),
    ] = 2
    fill_pinholes: Annotated[
        bool, about("robust: fill small holes inside an instance", expert=True)
    ] = True
    least_support: Annotated[
        float,
        about(
            "robust: an instance is dropped if fewer of the views that saw it found it",
            low=0.0,
            high=1.0,
        ),
    ] = 0.15
    border_band: Annotated[
        float,
        about(
            "robust: how far from a mask's border its evidence is soft",
            unit="px",
            low=0.0,
            high=15.0,
            expert=True,
        ),
    ] = 4.0
    sample_px: Annotated[
        float,
        about("robust: larger triangles get several samples", unit="px", low=0.5, expert=True),
    ] = 32.0
    most_splits: Annotated[
        int,
        about(
            "robust: at most this number squared of samples a triangle", low=1, high=64, expert=True
        ),
    ] = 8
    seed: Annotated[int, about("seed of Louvain and of the sampled rays", low=0, expert=True)] = 0

    def __post_init__(self) -> None:
        check_settings(self, "lift")

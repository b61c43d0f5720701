"""Settings of the sparse stage (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class SparseSettings:
    """How photos are matched and registered (COLMAP through pycolmap)."""

    features: Annotated[
        Literal["auto", "sift", "thorough", "xfeat"],
        about(
            "what photos are matched by: sift; auto: SIFT, and where photos stay out, SIFT on "
            "doubled photos; thorough: then XFeat, a network, beside it, which may also join what "
            "merely looks alike; xfeat: XFeat alone"
        ),
    ] = "auto"
    max_features: Annotated[
        int, about("most features kept of one photo", unit="features", low=500, high=65536)
    ] = 8192
    first_octave: Annotated[
        int,
        about(
            "SIFT octave to start at: -1 doubles the photo first (4 times slower)",
            low=-1,
            high=2,
            expert=True,
        ),
    ] = 0
    exhaustive_max: Annotated[
        int,
        about(
            "up to this many photos every pair is matched",
            unit="photos",
            low=2,
            high=2000,
            expert=True,
        ),
    ] = 60
    sequential: Annotated[
        int,
        about(
            "beyond that: each photo is matched with this many next ones in name order",
            low=1,
            expert=True,
        ),
    ] = 10
    retrieved: Annotated[
        int,
        about(
            "beyond that: and with this many of the most similar photos",
            unit="photos",
            low=1,
            expert=True,
        ),
    ] = 30
    min_matches: Annotated[
        int,
        about(
            "least verified matches that make a pair of photos count",
            unit="matches",
            low=8,
            expert=True,
        ),
    ] = 15
    threads: Annotated[int, about("CPU threads; 0 = all", unit="threads", low=0, high=512)] = 0
    seed: Annotated[int, about("seed of every random step", low=0, high=2**31 - 1, expert=True)] = 0
    reference: Annotated[
        str,
        about(
            "folder of a finished scan that the new photos are aligned to",
            content=("photos", "sparse", "scale.json"),
        ),
    ] = ""
    align: Annotated[
        Literal["constrained", "rigid"],
        about(
            "how they are aligned: constrained registers them against the fixed reference cameras; "
            "rigid reconstructs them alone and fits one similarity"
        ),
    ] = "constrained"
    reference_retrieved: Annotated[
        int,
        about(
            "reference photos that each new photo is matched with",
            unit="photos",
            low=2,
            high=1000,
            expert=True,
        ),
    ] = 20

    def __post_init__(self) -> None:
        check_settings(self, "sparse")

"""Settings of the sparse stage (light: no heavy imports)."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["SparseSettings"]


@dataclass(frozen=True)
class SparseSettings:
    """How photos are matched and registered (COLMAP through pycolmap)."""

    features: str = setting(
        "sift",
        "kind of local feature; aliked needs a pycolmap built with ONNX and is refused without",
        choices=("sift", "aliked"),
    )
    max_features: int = setting(
        8192, "most features kept of one photo", unit="features", low=500, high=65536
    )
    first_octave: int = setting(
        0, "SIFT octave to start at: -1 doubles the photo first (4 times slower)", low=-1, high=2
    )
    exhaustive_max: int = setting(
        200, "up to this many photos every pair is matched", unit="photos", low=2, high=2000
    )
    sequential: int = setting(
        10, "beyond that: each photo is matched with this many next ones in name order", low=1
    )
    retrieved: int = setting(
        30, "beyond that: and with this many of the most similar photos", unit="photos", low=1
    )
    min_matches: int = setting(
        15, "least verified matches that make a pair of photos count", unit="matches", low=8
    )
    threads: int = setting(0, "CPU threads; 0 = all", unit="threads", low=0, high=512)
    seed: int = setting(0, "seed of every random step", low=0, high=2**31 - 1)
    reference: str = setting(
        "",
        "folder of a finished scan that the new photos are aligned to",
        content=("photos", "sparse", "scale.json"),
    )
    align: str = setting(
        "constrained",
        "how they are aligned: constrained registers them against the fixed reference cameras; "
        "rigid reconstructs them alone and fits one similarity",
        choices=("constrained", "rigid"),
    )
    reference_retrieved: int = setting(
        20, "reference photos that each new photo is matched with", unit="photos", low=2, high=1000
    )

    def __post_init__(self) -> None:
        check_settings(self, "sparse")

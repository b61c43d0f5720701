"""Settings of `walltopo train classifier`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class ClassifierSettings:
    """Training settings of the cutout classifier."""

    side: Annotated[int, about("side of the square cutouts", unit="px", low=32, high=320)] = 64
    epochs: Annotated[int, about("passes over the cutouts", low=1, high=1000)] = 30
    batch: Annotated[int, about("cutouts per step", low=2, high=1024)] = 64
    rate: Annotated[float, about("peak learning rate of AdamW", low=1e-6, high=1.0)] = 2e-3
    held_out: Annotated[
        float, about("share of the holds kept for choosing the weights", low=0.05, high=0.5)
    ] = 0.2
    hue: Annotated[
        float, about("largest hue shift; 0.5 where classes do not tell colours", low=0.0, high=0.5)
    ] = 0.0
    rotation: Annotated[float, about("largest rotation", unit="deg", low=0.0, high=180.0)] = 20.0
    threads: Annotated[int, about("CPU threads", low=1)] = 1
    seed: Annotated[int, about("seed of weights, order and the split", low=0)] = 0

    def __post_init__(self) -> None:
        check_settings(self, "classifier")

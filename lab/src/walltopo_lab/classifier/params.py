"""Settings of `walltopo train classifier`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["ClassifierSettings"]


@dataclass(frozen=True)
class ClassifierSettings:
    """How a classifier of cutouts is trained."""

    side: int = setting(64, "side of the square cutouts", unit="px", low=32, high=320)
    epochs: int = setting(30, "passes over the cutouts", low=1, high=1000)
    batch: int = setting(64, "cutouts per step", low=2, high=1024)
    rate: float = setting(2e-3, "peak learning rate of AdamW", low=1e-6, high=1.0)
    held_out: float = setting(
        0.2, "share of the holds kept for choosing the weights", low=0.05, high=0.5
    )
    hue: float = setting(
        0.0, "largest hue shift; 0.5 where classes do not tell colours", low=0.0, high=0.5
    )
    rotation: float = setting(20.0, "largest rotation", unit="deg", low=0.0, high=180.0)
    threads: int = setting(1, "CPU threads", low=1)
    seed: int = setting(0, "seed of weights, order and the split", low=0)

    def __post_init__(self) -> None:
        check_settings(self, "classifier")

"""Settings of `walltopo train`."""

from __future__ import annotations

import difflib
import re
import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

from walltopo.core import InputError, SettingsError, check_settings, setting

__all__ = [
    "AUGMENTS",
    "AugmentSettings",
    "TrainSettings",
    "YoloSettings",
    "is_yolo",
    "read_augment",
    "read_values",
]


@dataclass(frozen=True)
class AugmentSettings:
    """How photos are varied; crops lie at random places whatever these say."""

    hue: float = setting(1.0, "largest hue shift, share of the circle", low=0.0, high=1.0)
    hue_share: float = setting(0.6, "share of crops whose hue is shifted", low=0.0, high=1.0)
    saturation: float = setting(0.7, "largest change of saturation", low=0.0, high=1.0)
    value: float = setting(0.4, "largest change of brightness", low=0.0, high=1.0)
    rotation: float = setting(20.0, "rotation of most crops", unit="deg", low=0.0, high=180.0)
    turn_share: float = setting(0.15, "share of crops turned by any angle", low=0.0, high=1.0)
    translation: float = setting(
        0.3, "shift of the object that a crop is laid around, share of the crop", low=0.0, high=0.5
    )
    flip: float = setting(0.5, "share of crops mirrored left to right", low=0.0, high=1.0)
    flip_vertical: float = setting(0.1, "share of crops upside down", low=0.0, high=1.0)
    scale_low: float = setting(0.6, "smallest scale of a photo", low=0.1, high=1.0)
    scale_high: float = setting(2.2, "largest scale of a photo", low=1.0, high=8.0)
    degrade: float = setting(0.25, "share blurred, noisy or compressed", low=0.0, high=1.0)
    mosaic: float = setting(0.0, "share of crops put together from four photos", low=0.0, high=1.0)
    crop_fraction: float = setting(
        1.0, "a crop shows the photo on at least this share of its sides", low=0.1, high=1.0
    )

    def __post_init__(self) -> None:
        check_settings(self, "augment")


AUGMENTS = {
    "default": AugmentSettings(),
    "none": AugmentSettings(
        hue=0.0,
        hue_share=0.0,
        saturation=0.0,
        value=0.0,
        rotation=0.0,
        turn_share=0.0,
        translation=0.0,
        flip=0.0,
        flip_vertical=0.0,
        scale_low=1.0,
        scale_high=1.0,
        degrade=0.0,
    ),
    # The ranges published for hold detectors: any hue, any angle, mosaics throughout.
    "published": AugmentSettings(
        hue_share=1.0,
        rotation=180.0,
        turn_share=0.0,
        translation=0.1,
        flip_vertical=0.5,
        scale_low=0.5,
        scale_high=1.5,
        degrade=0.0,
        mosaic=1.0,
        crop_fraction=0.5,
    ),
}


def read_augment(name: str) -> AugmentSettings:
    """`default`, `none`, `published`, or the settings in a TOML file (others stay default).

    Raises
    ------
    InputError : no such file.
    SettingsError : no TOML, an unknown key (the nearest known one is named), a wrong value.
    """
    if name in AUGMENTS:
        return AUGMENTS[name]
    if not Path(name).is_file():
        raise InputError(
            f"{name}: no such file of augmentation settings",
            f"Give {', '.join(AUGMENTS)}, or a TOML file.",
        )
    return AugmentSettings(**read_values(Path(name), AugmentSettings))


def read_values(path: Path, kind: type[Any]) -> dict[str, Any]:
    """Fields of a settings class from a TOML file.

    Raises
    ------
    InputError : no such file.
    SettingsError : no TOML, an unknown key (the nearest known one is named), a wrong type.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such file of settings")
    try:
        values = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path}: not valid TOML ({error})") from error
    known: dict[str, Any] = {field.name: type(field.default) for field in fields(kind)}
    for key, value in values.items():
        if key not in known:
            near = difflib.get_close_matches(key, known, 1)
            hint = f"Did you mean {near[0]}?" if near else f"Known: {', '.join(known)}"
            raise SettingsError(f"{path}: unknown setting {key!r}", hint)
        wanted = (int, float) if known[key] is float else known[key]
        if isinstance(value, bool) or not isinstance(value, wanted):
            told = "a number" if known[key] is float else f"of type {known[key].__name__}"
            raise SettingsError(f"{path}: {key}: expected {told}, got {value!r}")
    return {key: known[key](value) for key, value in values.items()}


@dataclass(frozen=True)
class TrainSettings:
    """How long and on what the detector is trained."""

    minutes: float = setting(
        60.0, "time to train, all resumed parts together", unit="min", low=0.01
    )
    crop: int = setting(480, "side of a training crop, a multiple of 32", unit="px", low=64)
    batch: int = setting(8, "crops per step", low=1)
    rate: float = setting(2e-3, "peak learning rate of AdamW", low=1e-6, high=1.0)
    momentum: float = setting(0.9, "decay of AdamW's mean of the gradient", low=0.0, high=0.999)
    network: str = setting(
        "s", "size of the network, smallest to largest", choices=("n", "s", "m", "l", "x")
    )
    weight_decay: float = setting(0.02, "weight decay of AdamW", low=0.0, high=1.0)
    warmup: float = setting(0.02, "share of the time spent raising the rate", low=0.0, high=0.5)
    ema: float = setting(0.998, "decay of the averaged weights", low=0.0, high=0.99999)
    held_out: float = setting(0.08, "share of the sources kept for choosing", low=0.0, high=0.5)
    synthetic: float = setting(0.25, "share of crops from sets with exact masks", low=0.0, high=1.0)
    patience: int = setting(12, "stop after so many checks without gain", low=1)
    check_every: float = setting(
        6.0, "time between checks on the held-out photos", unit="min", low=0.0
    )
    check_photos: int = setting(24, "held-out photos looked at in a check", low=1)
    audit: float = setting(
        0.3, "share of the time after which labels are checked; 0 never", low=0.0, high=1.0
    )
    threads: int = setting(1, "CPU threads beside the one that makes crops", low=1)
    seed: int = setting(0, "seed of weights, crops and the split", low=0)
    device: str = setting("auto", "where to train", choices=("auto", "cpu", "cuda"))

    def __post_init__(self) -> None:
        check_settings(self, "train")


@dataclass(frozen=True)
class YoloSettings:
    """How long and with what Ultralytics trains one of its networks."""

    minutes: float = setting(
        60.0, "time to train, all resumed parts together", unit="min", low=0.01
    )
    size: int = setting(640, "photos are resized to this", unit="px", low=32)
    batch: int = setting(8, "photos per step", low=1)
    rate: float = setting(1e-2, "initial learning rate of SGD", low=1e-6, high=1.0)
    momentum: float = setting(0.937, "momentum of SGD", low=0.0, high=0.999)
    held_out: float = setting(0.08, "share of the sources kept for choosing", low=0.0, high=0.5)
    patience: int = setting(50, "stop after so many epochs without gain", low=1)
    threads: int = setting(1, "CPU threads", low=1)
    seed: int = setting(0, "seed of weights and order", low=0)
    device: str = setting("auto", "where to train", choices=("auto", "cpu", "cuda"))

    def __post_init__(self) -> None:
        check_settings(self, "yolo")


def is_yolo(name: str) -> bool:
    """Whether a model's name is one of Ultralytics' (`yolo11s-seg`, `rtdetr-l`)."""
    return re.fullmatch(r"yolo(v8|v9|v10|11|12)[ntsmclxe](-seg)?|rtdetr-[lx]", name) is not None

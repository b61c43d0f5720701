"""Settings of `walltopo train`."""

from __future__ import annotations

import re
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Annotated, Any, Literal

from walltopo.core import InputError, SettingsError, about, check_settings
from walltopo.core.files import read_toml
from walltopo.core.settings import unknown_setting


@dataclass(frozen=True)
class AugmentSettings:
    """Settings of the augmentation; crops are always at random positions."""

    hue: Annotated[float, about("largest hue shift, share of the circle", low=0.0, high=1.0)] = 1.0
    hue_share: Annotated[float, about("share of crops whose hue is shifted", low=0.0, high=1.0)] = (
        0.6
    )
    saturation: Annotated[float, about("largest change of saturation", low=0.0, high=1.0)] = 0.7
    value: Annotated[float, about("largest change of brightness", low=0.0, high=1.0)] = 0.4
    rotation: Annotated[float, about("rotation of most crops", unit="deg", low=0.0, high=180.0)] = (
        20.0
    )
    turn_share: Annotated[float, about("share of crops turned by any angle", low=0.0, high=1.0)] = (
        0.15
    )
    translation: Annotated[
        float,
        about(
            "shift of the object that a crop is laid around, share of the crop", low=0.0, high=0.5
        ),
    ] = 0.3
    flip: Annotated[float, about("share of crops mirrored left to right", low=0.0, high=1.0)] = 0.5
    flip_vertical: Annotated[float, about("share of crops upside down", low=0.0, high=1.0)] = 0.1
    scale_low: Annotated[float, about("smallest scale of a photo", low=0.1, high=1.0)] = 0.6
    scale_high: Annotated[float, about("largest scale of a photo", low=1.0, high=8.0)] = 2.2
    degrade: Annotated[float, about("share blurred, noisy or compressed", low=0.0, high=1.0)] = 0.25
    mosaic: Annotated[
        float, about("share of crops put together from four photos", low=0.0, high=1.0)
    ] = 0.0
    paste: Annotated[
        float,
        about("share of crops with objects pasted from sets with exact masks", low=0.0, high=1.0),
    ] = 0.0
    crop_fraction: Annotated[
        float,
        about("a crop shows the photo on at least this share of its sides", low=0.1, high=1.0),
    ] = 1.0

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
    # The published ranges for hold detectors: any hue, any angle, mosaics throughout.
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
    """Return the named settings (`default`, `none`, `published`) or those of a TOML file.

    Raises
    ------
    InputError : the file is missing or is not TOML.
    SettingsError : an unknown key (the nearest known one is named), a wrong value.
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
    """Return fields of a settings class from a TOML file.

    Raises
    ------
    InputError : the file is missing or is not TOML.
    SettingsError : an unknown key (the nearest known one is named), a wrong type.
    """
    values = read_toml(path)
    known: dict[str, Any] = {field.name: type(field.default) for field in fields(kind)}
    for key, value in values.items():
        if key not in known:
            raise unknown_setting(key, known, str(path), f"Known: {', '.join(known)}.")
        wanted = (int, float) if known[key] is float else known[key]
        if isinstance(value, bool) or not isinstance(value, wanted):
            expected = "a number" if known[key] is float else f"of type {known[key].__name__}"
            raise SettingsError(f"{path}: {key}: expected {expected}, got {value!r}")
    return {key: known[key](value) for key, value in values.items()}


@dataclass(frozen=True)
class TrainSettings:
    """Training settings of the vote network."""

    minutes: Annotated[
        float,
        about(
            "time to train, all resumed parts together; 0: without end, at a constant rate",
            unit="min",
            low=0.0,
        ),
    ] = 60.0
    crop: Annotated[int, about("side of a training crop, a multiple of 32", unit="px", low=64)] = (
        480
    )
    batch: Annotated[int, about("crops per step", low=1)] = 8
    rate: Annotated[float, about("peak learning rate of AdamW", low=1e-6, high=1.0)] = 1.2e-3
    encoder_rate: Annotated[
        float,
        about(
            "rate of the encoder as a share of the rate; 0 freezes the encoder", low=0.0, high=1.0
        ),
    ] = 0.4
    momentum: Annotated[
        float, about("decay of AdamW's mean of the gradient", low=0.0, high=0.999)
    ] = 0.9
    network: Annotated[
        Literal["lite0", "lite1", "lite2"], about("size of a new network, smallest to largest")
    ] = "lite2"
    start: Annotated[Literal["imagenet", "random"], about("weights of a new network's encoder")] = (
        "imagenet"
    )
    weight_decay: Annotated[float, about("weight decay of AdamW", low=0.0, high=1.0)] = 0.03
    warmup: Annotated[
        float, about("share of the time spent raising the rate", low=0.0, high=0.5)
    ] = 0.02
    ema: Annotated[float, about("decay of the averaged weights", low=0.0, high=0.99999)] = 0.998
    held_out: Annotated[
        float, about("share of the sources kept for choosing", low=0.0, high=0.5)
    ] = 0.08
    synthetic: Annotated[
        float, about("share of crops from sets with exact masks", low=0.0, high=1.0)
    ] = 0.25
    patience: Annotated[int, about("stop after so many checks without gain", low=1)] = 12
    check_every: Annotated[
        float, about("time between checks on the held-out photos", unit="min", low=0.0)
    ] = 6.0
    check_photos: Annotated[int, about("held-out photos looked at in a check", low=1)] = 24
    audit: Annotated[
        float, about("share of the time after which labels are checked; 0 never", low=0.0, high=1.0)
    ] = 0.3
    threads: Annotated[int, about("CPU threads beside the one that makes crops", low=1)] = 1
    workers: Annotated[
        int,
        about("processes that make crops; 0: a thread, with a GPU all cores but two", low=0),
    ] = 0
    seed: Annotated[int, about("seed of weights, crops and the split", low=0)] = 0
    device: Annotated[Literal["auto", "cpu", "cuda"], about("where to train")] = "auto"

    def __post_init__(self) -> None:
        check_settings(self, "train")

    @property
    def is_endless(self) -> bool:
        """Return whether training runs until it is stopped."""
        return self.minutes == 0


@dataclass(frozen=True)
class YoloSettings:
    """Training settings of an Ultralytics network."""

    minutes: Annotated[
        float, about("time to train, all resumed parts together", unit="min", low=0.01)
    ] = 60.0
    size: Annotated[int, about("photos are resized to this", unit="px", low=32)] = 640
    batch: Annotated[int, about("photos per step", low=1)] = 8
    rate: Annotated[float, about("initial learning rate of SGD", low=1e-6, high=1.0)] = 1e-2
    momentum: Annotated[float, about("momentum of SGD", low=0.0, high=0.999)] = 0.937
    held_out: Annotated[
        float, about("share of the sources kept for choosing", low=0.0, high=0.5)
    ] = 0.08
    patience: Annotated[int, about("stop after so many epochs without gain", low=1)] = 50
    threads: Annotated[int, about("CPU threads", low=1)] = 1
    seed: Annotated[int, about("seed of weights and order", low=0)] = 0
    device: Annotated[Literal["auto", "cpu", "cuda"], about("where to train")] = "auto"

    def __post_init__(self) -> None:
        check_settings(self, "yolo")


def is_yolo(name: str) -> bool:
    """Return whether a model's name is one of Ultralytics' (`yolo11s-seg`, `rtdetr-l`)."""
    return re.fullmatch(r"yolo(v8|v9|v10|11|12)[ntsmclxe](-seg)?|rtdetr-[lx]", name) is not None

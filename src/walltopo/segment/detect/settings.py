"""Settings of the `detect` stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class DetectSettings:
    """Which detector sees the holds, and how."""

    model: Annotated[
        str,
        about(
            "detector: onnx (shipped), yolo11-seg, yolo11-sam, rtdetr-sam, or a model file",
            content=(".",),
        ),
    ] = "onnx"
    weights: Annotated[
        str,
        # A .pt file is a pickle: to load it is to run what it holds.
        about(
            "weights of the Ultralytics families, trained on holds (.pt)",
            content=(".",),
            program=True,
        ),
    ] = ""
    sam: Annotated[
        Literal["mobile-sam", "sam-b", "sam2.1-t", "sam2.1-b"],
        about("which Segment Anything draws the masks of the -sam families", expert=True),
    ] = "mobile-sam"
    score: Annotated[
        float,
        about("least score of a detection; 0 takes the model's own, by class", low=0.0, high=1.0),
    ] = 0.0
    size: Annotated[
        int,
        about(
            "photos are resized so that their longer side is this", unit="px", low=128, high=8192
        ),
    ] = 1600
    again: Annotated[
        float,
        about(
            "shipped and own networks look once more, at the mirrored photo at this share of the "
            "size; 0 looks once, in half the time",
            low=0.0,
            high=1.0,
        ),
    ] = 0.6
    tile: Annotated[
        int,
        about(
            "resized photos larger than this are looked at in tiles",
            unit="px",
            low=128,
            high=8192,
            expert=True,
        ),
    ] = 1664
    batch: Annotated[
        int,
        about(
            "tiles the network looks at in one go, if its file allows; 0: as many as memory takes",
            low=0,
            high=256,
            expert=True,
        ),
    ] = 0
    overlap: Annotated[
        int, about("overlap of neighbouring tiles", unit="px", low=0, high=2048, expert=True)
    ] = 192
    device: Annotated[
        Literal["auto", "cpu", "cuda"],
        about("where the network runs; auto takes a GPU if there is one"),
    ] = "auto"
    threads: Annotated[
        int, about("CPU threads of the network; 0 takes all cores", low=0, high=256)
    ] = 0

    def __post_init__(self) -> None:
        check_settings(self, "detect")

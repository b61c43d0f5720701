"""Settings of the `detect` stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["DetectSettings"]


@dataclass(frozen=True)
class DetectSettings:
    """Which detector sees the holds, and how."""

    model: str = setting(
        "onnx",
        "detector: onnx (shipped), yolo11-seg, yolo11-sam, rtdetr-sam, or a model file",
        content=(".",),
    )
    weights: str = setting(
        "", "weights of the Ultralytics families, trained on holds (.pt)", content=(".",)
    )
    sam: str = setting(
        "mobile-sam",
        "which Segment Anything draws the masks of the -sam families",
        choices=("mobile-sam", "sam-b", "sam2.1-t", "sam2.1-b"),
    )
    score: float = setting(
        0.0, "least score of a detection; 0 takes the model's own, by class", low=0.0, high=1.0
    )
    size: int = setting(
        1600, "photos are resized so that their longer side is this", unit="px", low=128, high=8192
    )
    again: float = setting(
        0.6,
        "networks of `walltopo train` look once more, at the mirrored photo at this share of the "
        "size; 0 looks once, in half the time",
        low=0.0,
        high=1.0,
    )
    tile: int = setting(
        1664,
        "resized photos larger than this are looked at in tiles",
        unit="px",
        low=128,
        high=8192,
    )
    batch: int = setting(
        0,
        "tiles the network looks at in one go, if its file allows; 0: as many as memory takes",
        low=0,
        high=256,
    )
    overlap: int = setting(192, "overlap of neighbouring tiles", unit="px", low=0, high=2048)
    device: str = setting(
        "auto",
        "where the network runs; auto takes a GPU if there is one",
        choices=("auto", "cpu", "cuda"),
    )
    threads: int = setting(0, "CPU threads of the network; 0 takes all cores", low=0, high=256)

    def __post_init__(self) -> None:
        check_settings(self, "detect")

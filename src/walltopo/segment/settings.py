"""Settings of the stages detect and propose."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class DetectSettings:
    """Settings of the detector."""

    # fmt: off
    model: Annotated[str, about("Detector: onnx (shipped), yolo11-seg, yolo11-sam, rtdetr-sam, or a model file", content=(".",))] = "onnx"
    # A .pt file is a pickle: loading it runs the code that it contains.
    weights: Annotated[str, about("Weights (.pt) of the Ultralytics families, trained on holds", content=(".",), program=True)] = ""
    sam: Annotated[Literal["mobile-sam", "sam-b", "sam2.1-t", "sam2.1-b"], about("Segment Anything model of the -sam families", expert=True)] = "mobile-sam"
    score: Annotated[float, about("Minimum score of a detection; 0 uses the model's own, by class", low=0.0, high=1.0)] = 0.0
    size: Annotated[int, about("Photos are resized to this longer side", unit="px", low=128, high=8192)] = 1408
    again: Annotated[float, about("Detect again in the mirrored photo at this share of the size; 0: only once, in half the time", low=0.0, high=1.0, expert=True)] = 0.6
    tile: Annotated[int, about("Larger resized photos are processed in tiles of this size", unit="px", low=128, high=8192, expert=True)] = 1664
    batch: Annotated[int, about("Tiles per network call; 0: as many as fit into memory", low=0, high=256, expert=True)] = 0
    overlap: Annotated[int, about("Overlap of neighbouring tiles", unit="px", low=0, high=2048, expert=True)] = 192
    device: Annotated[Literal["auto", "cpu", "cuda"], about("Where the network runs; auto uses a GPU if available")] = "auto"
    precision: Annotated[Literal["auto", "float", "int8"], about("Numbers of the shipped network; auto uses int8 where it is faster: CPUs with AVX-512 VNNI", expert=True)] = "auto"
    threads: Annotated[int, about("CPU threads; 0 uses all", low=0, high=256, expert=True)] = 0
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "detect")


@dataclass(frozen=True)
class ProposeSettings:
    """Settings of the evidence from the mesh (section `propose`)."""

    # fmt: off
    volumes: Annotated[bool, about("Add volumes that no mask shows, by their shape", expert=True)] = True
    relief: Annotated[bool, about("Use relief and colour as evidence in addition to the masks (when: docs/propose.md)")] = False
    sure: Annotated[float, about("Instances with a lower lift score get the outline of their bump in the relief", low=0.0, high=1.0, expert=True)] = 0.15
    listed: Annotated[float, about("Minimum hold probability of an instance without any mask", low=0.0, high=1.0, expert=True)] = 0.1
    seed: Annotated[int, about("Random seed", low=0, expert=True)] = 0
    # fmt: on

    def __post_init__(self) -> None:
        check_settings(self, "propose")

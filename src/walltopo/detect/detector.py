"""The protocol of all detectors, and how a name on the command line becomes one."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.detect.found import Found
from walltopo.detect.params import DetectSettings

__all__ = ["BUILT_IN", "Detector", "open_detector", "shipped_model"]


class Detector(Protocol):
    """Something that sees objects in a photo."""

    @property
    def classes(self) -> dict[int, str]:
        """Class names by label (>= 1)."""

    @property
    def description(self) -> str:
        """The model in a few words, for reports."""

    def detect(self, photo: NDArray[np.uint8]) -> Found:
        """Objects of a photo.

        Parameters
        ----------
        photo : (H, W, 3) uint8, RGB.

        Returns
        -------
        Found, in the photo's own pixels, with masks, best first.
        """


def shipped_model() -> Path:
    """The weights that come with the package."""
    return Path(__file__).parents[1] / "models" / "holds.onnx"


def _shipped(settings: DetectSettings) -> Detector:
    from walltopo.detect.onnx_detector import OnnxDetector

    return OnnxDetector(shipped_model(), settings)


def _family(name: str) -> Callable[[DetectSettings], Detector]:
    def opened(settings: DetectSettings) -> Detector:
        from walltopo.detect.families import open_family

        return open_family(name, settings)

    return opened


BUILT_IN: dict[str, Callable[[DetectSettings], Detector]] = {
    "onnx": _shipped,
    **{name: _family(name) for name in ("yolo11-seg", "yolo11-sam", "rtdetr-sam")},
}


def open_detector(settings: DetectSettings) -> Detector:
    """The detector that `settings.model` names.

    Raises
    ------
    InputError : neither a known name nor a model file.
    EnvironmentLacksError : an extra or weights that the named detector needs are absent.
    """
    if settings.model in BUILT_IN:
        return BUILT_IN[settings.model](settings)
    path = Path(settings.model)
    if path.suffix == ".onnx":
        from walltopo.detect.onnx_detector import OnnxDetector

        return OnnxDetector(path, settings)
    raise InputError(
        f"{settings.model!r} is no known detector and no .onnx file",
        f"Known detectors: {', '.join(BUILT_IN)}; or the path of an ONNX file.",
    )

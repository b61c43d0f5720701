"""The protocol of all detectors, and how a name on the command line becomes one."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.core.files import shipped_file
from walltopo.segment.detect.found import Found
from walltopo.segment.detect.settings import DetectSettings


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
    return shipped_file("holds.onnx")


def _shipped(settings: DetectSettings) -> Detector:
    from walltopo.segment.detect.onnx_detector import OnnxDetector

    return OnnxDetector(shipped_model(), settings)


BUILT_IN: dict[str, Callable[[DetectSettings], Detector]] = {"onnx": _shipped}

# Detectors of other distributions: an entry point of this group is called with its own name and
# the settings, and gives a `Detector`.
ENTRY_POINTS = "walltopo.detectors"


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
        from walltopo.segment.detect.onnx_detector import OnnxDetector

        return OnnxDetector(path, settings)
    others = {point.name: point for point in entry_points(group=ENTRY_POINTS)}
    if settings.model in others:
        detector: Detector = others[settings.model].load()(settings.model, settings)
        return detector
    raise InputError(
        f"{settings.model!r} is no known detector and no .onnx file",
        f"Known detectors: {', '.join([*BUILT_IN, *sorted(others)])}; or the path of an ONNX "
        "file. More come with walltopo-lab.",
    )

"""The protocol of all detectors, and the choice of a detector by name."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Final, Protocol

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import shipped_file
from walltopo.core.plugins import PluginGroup
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.settings import DetectSettings


class Detector(Protocol):
    """A model that detects objects in a photo."""

    @property
    def classes(self) -> dict[int, str]:
        """Return the class names by label (>= 1)."""

    @property
    def description(self) -> str:
        """Return a short name of the model, for reports."""

    def detect(self, photo: NDArray[np.uint8]) -> PhotoDetections:
        """Return the objects of a photo.

        Parameters
        ----------
        photo : (H, W, 3) uint8, RGB.

        Returns
        -------
        The objects in the photo's own pixels, with masks, highest score first.
        """


def shipped_model() -> Path:
    """Return the path of the weights that come with the package."""
    return shipped_file("holds.onnx")


def shipped_quantized() -> Path:
    """Return the path of the same weights as 8-bit integers, made by `make train-quantize`."""
    return shipped_file("holds-int8.onnx")


def open_shipped(name: str, settings: DetectSettings) -> Detector:
    """Return the detector `onnx`: the weights that come with the package.

    The precision `auto` takes the quantized network where it is faster: on a processor with dot
    products of 8-bit integers, without a GPU.
    """
    from walltopo.images.networks import has_integer_products, runs_on_gpu
    from walltopo.segment.detect.onnx_detector import OnnxDetector

    faster = settings.precision == "auto" and not runs_on_gpu(settings.device)
    quantized = settings.precision == "int8" or (faster and has_integer_products())
    return OnnxDetector(shipped_quantized() if quantized else shipped_model(), settings)


DetectorFactory = Callable[[str, DetectSettings], Detector]

# An entry point is called with its own name and the settings, and returns a `Detector`.
DETECTORS: Final[PluginGroup[DetectorFactory]] = PluginGroup(
    "walltopo.detectors",
    "detector",
    "neither a known detector nor an .onnx file",
    "or the path of an ONNX file. More come with walltopo-lab.",
)


def open_detector(settings: DetectSettings) -> Detector:
    """Return the detector that `settings.model` names.

    Raises
    ------
    InputError : the name is neither a known detector nor a model file.
    EnvironmentLacksError : an extra or the weights that the detector needs are missing.
    """
    path = Path(settings.model)
    if path.suffix == ".onnx":
        from walltopo.segment.detect.onnx_detector import OnnxDetector

        return OnnxDetector(path, settings)
    return DETECTORS.load(settings.model)(settings.model, settings)

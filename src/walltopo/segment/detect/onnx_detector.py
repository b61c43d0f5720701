"""The default detector: an ONNX network on whole photos or tiles."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.networks import Network, open_network
from walltopo.segment.detect.photo_detections import PhotoDetections
from walltopo.segment.detect.tiles import fuse, merge_tiles, mirrored, run_batched, tiles_of
from walltopo.segment.detect.votes import decode_votes
from walltopo.segment.detect.yolo import decode_rtdetr, decode_yolo, letterbox
from walltopo.segment.settings import DetectSettings

_OUTPUTS = {"votes": 3, "yolo-seg": 2, "yolo-det": 1, "rtdetr": 1}


@dataclass(frozen=True, eq=False)
class OnnxModel(Network):
    """A loaded detection network.

    Parameters
    ----------
    head : the format of the outputs: `votes`, `yolo-seg`, `yolo-det` or `rtdetr`.
    classes : class names by label (>= 1). walltopo's own models start with hold 1, volume 2.
    size : (height, width) of the input in pixels, or None if the input size is free.
    batched : whether the network takes several photos at once.
    """

    head: str
    classes: dict[int, str]
    size: tuple[int, int] | None
    batched: bool


def open_onnx(path: Path, device: str, threads: int) -> OnnxModel:
    """Load a detection network.

    Raises
    ------
    InputError : as `open_network`, or the metadata do not name the output format.
    EnvironmentLacksError : CUDA is requested but not available.
    """
    network = open_network(path, device, threads)
    head = _head_of(network)
    classes = dict(enumerate(network.names, start=1))
    shape = network.input_shape
    rows, cols = (shape[1], shape[2]) if head == "votes" else (shape[2], shape[3])
    fixed = (rows, cols) if isinstance(rows, int) and isinstance(cols, int) else None
    batched = not isinstance(shape[0], int)
    return OnnxModel(path, network.session, network.metadata, head, classes, fixed, batched)


def _head_of(network: Network) -> str:
    """Return the output format of a network, from its own metadata or those of Ultralytics."""
    metadata = network.metadata
    # Recent Ultralytics exports also write a `head`: the name of their last layer.
    if metadata.get("head") == "votes":
        head = "votes"
    elif metadata.get("task") == "segment":
        head = "yolo-seg"
    elif metadata.get("task") == "detect":
        rtdetr = "rtdetr" in metadata.get("description", "").lower().replace("-", "")
        head = "rtdetr" if rtdetr else "yolo-det"
    else:
        raise InputError(
            f"{network.path}: the metadata do not name the output format (`head`, `task`); "
            f"found {sorted(metadata)}",
            "Export with `walltopo train` or with Ultralytics (format=onnx), which write them.",
        )
    outputs = len(network.session.get_outputs())
    if outputs != _OUTPUTS[head]:
        raise InputError(
            f"{network.path}: a {head} network has {_OUTPUTS[head]} outputs, "
            f"this file has {outputs}"
        )
    return head


_STRIDE = 32  # the network halves its input five times

# With two passes, a weak detection of one pass counts if the other pass scores it well.
_TWO_PASS_FACTOR = 0.3


class OnnxDetector:
    """A detector that runs an exported network: `walltopo train`'s, or Ultralytics' YOLO, RT-DETR.

    Parameters
    ----------
    path : the ONNX file.
    settings : size, tiles, threshold, device.
    """

    def __init__(self, path: Path, settings: DetectSettings) -> None:
        self.settings = settings
        self.model: OnnxModel = open_onnx(path, settings.device, settings.threads)
        self.thresholds = self._thresholds()
        self._input = self.model.session.get_inputs()[0].name

    @property
    def classes(self) -> dict[int, str]:
        return self.model.classes

    @property
    def description(self) -> str:
        version = self.model.metadata.get("version", "")
        return f"{self.model.path.name} {version}".strip()

    def _thresholds(self) -> dict[int, float]:
        """Return the minimum score by label: from the setting, else from the model's metadata."""
        default = 0.3 if self.model.head == "votes" else 0.25  # Ultralytics' own default
        own = self.model.number("score", default)
        scores = self.model.read_numbers("scores", [own] * len(self.classes))
        if self.settings.score:
            return dict.fromkeys(self.classes, self.settings.score)
        return dict(zip(self.classes, scores, strict=True))

    def detect(self, photo: NDArray[np.uint8]) -> PhotoDetections:
        """Return the objects of an (H, W, 3) uint8 RGB photo, in its pixels, best first."""
        size, second_scale = self.settings.size, self.settings.again
        if self.model.head != "votes" or not second_scale:
            return self._above_threshold(self._detect_at(photo, size))
        flipped = np.ascontiguousarray(photo[:, ::-1])
        second = mirrored(self._detect_at(flipped, max(_STRIDE, round(size * second_scale))))
        return self._above_threshold(fuse([self._detect_at(photo, size), second]))

    def _above_threshold(self, found: PhotoDetections) -> PhotoDetections:
        limits = np.array([self.thresholds[int(label)] for label in found.labels])
        return found.pick(np.flatnonzero(found.scores >= limits))

    def _detect_at(self, photo: NDArray[np.uint8], size: int) -> PhotoDetections:
        """Return the objects found in one pass, with the photo's longer side resized to `size`."""
        height, width = photo.shape[:2]
        scale = size / max(height, width)
        side = min(self.model.size) if self.model.size else self.settings.tile
        tile = max(_STRIDE, int(side / scale))
        overlap = int(self.settings.overlap / scale)
        windows = tiles_of(width, height, tile, overlap)
        crops = [photo[w.y0 : w.y1, w.x0 : w.x1] for w in windows]
        inputs = [self._prepare(crop, scale) for crop in crops]
        max_batch = self.settings.batch if self.model.batched else 1
        parts = [
            (window, self._decode(output, crop.shape[1], crop.shape[0], scale))
            for window, crop, output in zip(
                windows, crops, run_batched(self._run, inputs, max_batch), strict=True
            )
        ]
        if len(parts) == 1:
            return parts[0][1]
        return merge_tiles(parts, width, height)

    def _prepare(self, photo: NDArray[np.uint8], scale: float) -> NDArray[np.generic]:
        """Return one tile, or the whole photo, as the network's input."""
        if self.model.head == "votes":
            return prepare(photo, scale)
        rows, cols = self.model.size or padded_size(photo, scale)
        if self.model.head == "rtdetr":
            stretched = cv2.resize(photo, (cols, rows), interpolation=cv2.INTER_LINEAR)
            return letterbox(np.asarray(stretched, dtype=np.uint8), 1.0, rows, cols)[0]
        return letterbox(photo, scale, rows, cols)[0]

    def _decode(
        self, outputs: list[NDArray[np.float32]], width: int, height: int, scale: float
    ) -> PhotoDetections:
        """Return the objects of one tile from the network's outputs."""
        size = (width, height)
        model, classes = self.model, len(self.model.classes)
        min_score = min(self.thresholds.values())
        if model.head == "votes":
            heat, votes, mask = outputs
            min_score *= _TWO_PASS_FACTOR if self.settings.again else 1.0
            overlap = model.number("nms", 0.5)
            found = decode_votes(heat, votes, mask, min_score, scale, size, overlap)
            return _subtract_offset(found, model.read_numbers("offset", [0.0, 0.0]), scale)
        if model.head == "rtdetr":
            return decode_rtdetr(outputs[0], classes, min_score, size)
        prototypes = outputs[1] if len(outputs) > 1 else None
        return decode_yolo(outputs[0], prototypes, classes, min_score, scale, size)

    def _run(self, values: NDArray[np.generic]) -> list[NDArray[np.float32]]:
        """Return the network's outputs for (n, ...) inputs, n first."""
        outputs = self.model.session.run(None, {self._input: values})
        return [np.asarray(output, dtype=np.float32) for output in outputs]


def _subtract_offset(found: PhotoDetections, offset: list[float], scale: float) -> PhotoDetections:
    """Return the boxes without the network's systematic offset, given in input pixels."""
    shift = np.array([*offset, *offset]) / scale
    extent = np.array([found.width, found.height, found.width, found.height], dtype=np.float64)
    return replace(found, boxes=np.clip(found.boxes - shift, 0.0, extent))


def padded_size(photo: NDArray[np.uint8], scale: float) -> tuple[int, int]:
    """Return the rows and columns of the input: the scaled photo, rounded up to the stride."""
    inner = (max(1, round(n * scale)) for n in photo.shape[:2])
    rows, cols = (-(-n // _STRIDE) * _STRIDE for n in inner)
    return rows, cols


def prepare(photo: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """Return the photo at `scale` in the top left of a black image with sides multiple of 32."""
    height, width = photo.shape[:2]
    inner = (max(1, round(width * scale)), max(1, round(height * scale)))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    resized = cv2.resize(photo, inner, interpolation=method) if scale != 1 else photo
    rows, cols = padded_size(photo, scale)
    canvas = np.zeros((rows, cols, 3), np.uint8)
    canvas[: inner[1], : inner[0]] = resized
    return canvas

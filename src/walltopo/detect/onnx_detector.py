"""The default detector: an ONNX file, whole photos or tiles."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.detect.augmented import fuse, mirrored
from walltopo.detect.batch_size import run_batched
from walltopo.detect.contract import DetectSettings
from walltopo.detect.found import Found
from walltopo.detect.onnx_model import OnnxModel, open_onnx
from walltopo.detect.tiles import merge_tiles, tiles_of
from walltopo.detect.votes import decode_votes
from walltopo.detect.yolo import decode_rtdetr, decode_yolo, letterbox

__all__ = ["OnnxDetector"]

_STRIDE = 32  # the network halves its input five times
_HARDLY = 0.3


class OnnxDetector:
    """Runs an exported network: `walltopo train`'s, or Ultralytics' YOLO and RT-DETR.

    Parameters
    ----------
    path : the ONNX file.
    settings : size, tiles, threshold, device.
    """

    def __init__(self, path: Path, settings: DetectSettings) -> None:
        self.settings = settings
        self.model: OnnxModel = open_onnx(path, settings.device, settings.threads)
        self.scores = self._thresholds()
        self._input = self.model.session.get_inputs()[0].name

    @property
    def classes(self) -> dict[int, str]:
        return self.model.classes

    @property
    def description(self) -> str:
        version = self.model.metadata.get("version", "")
        return f"{self.model.path.name} {version}".strip()

    def _thresholds(self) -> dict[int, float]:
        """Least score by label: the setting, else the model's own."""
        default = 0.3 if self.model.head == "votes" else 0.25  # Ultralytics' own default
        own = self.model.number("score", default)
        scores = self.model.numbers("scores", [own] * len(self.classes))
        return (
            dict(zip(self.classes, scores, strict=True))
            if not self.settings.score
            else (dict.fromkeys(self.classes, self.settings.score))
        )

    def detect(self, photo: NDArray[np.uint8]) -> Found:
        """Objects of an (H, W, 3) uint8 RGB photo, in its pixels, best first."""
        size, share = self.settings.size, self.settings.again
        if self.model.head != "votes" or not share:
            return self._sure(self._whole(photo, size))
        other = np.ascontiguousarray(photo[:, ::-1])
        second = mirrored(self._whole(other, max(_STRIDE, round(size * share))))
        return self._sure(fuse([self._whole(photo, size), second]))

    def _sure(self, found: Found) -> Found:
        least = np.array([self.scores[int(label)] for label in found.labels])
        return found.pick(np.flatnonzero(found.scores >= least))

    def _whole(self, photo: NDArray[np.uint8], size: int) -> Found:
        """One look at the photo, resized so that its longer side is `size`."""
        height, width = photo.shape[:2]
        scale = size / max(height, width)
        side = min(self.model.size) if self.model.size else self.settings.tile
        tile = max(_STRIDE, int(side / scale))
        overlap = int(self.settings.overlap / scale)
        windows = tiles_of(width, height, tile, overlap)
        crops = [photo[w.y0 : w.y1, w.x0 : w.x1] for w in windows]
        inputs = [self._prepare(crop, scale) for crop in crops]
        most = self.settings.batch if self.model.many else 1
        parts = [
            (window, self._decode(output, crop.shape[1], crop.shape[0], scale))
            for window, crop, output in zip(
                windows, crops, run_batched(self._run, inputs, most), strict=True
            )
        ]
        if len(parts) == 1:
            return parts[0][1]
        return merge_tiles(parts, width, height)

    def _prepare(self, photo: NDArray[np.uint8], scale: float) -> NDArray[np.generic]:
        """One tile, or the whole photo, as the network wants it."""
        if self.model.head == "votes":
            return prepare(photo, scale)
        rows, cols = self.model.size or padded_size(photo, scale)
        if self.model.head == "rtdetr":
            stretched = cv2.resize(photo, (cols, rows), interpolation=cv2.INTER_LINEAR)
            return letterbox(np.asarray(stretched, dtype=np.uint8), 1.0, rows, cols)[0]
        return letterbox(photo, scale, rows, cols)[0]

    def _decode(
        self, outputs: list[NDArray[np.float32]], width: int, height: int, scale: float
    ) -> Found:
        """Objects of one tile from the network's outputs for it."""
        size = (width, height)
        model, classes, least = self.model, len(self.model.classes), min(self.scores.values())
        if model.head == "votes":
            heat, votes, mask = outputs
            # What one look hardly sees counts if the other sees it well.
            least *= _HARDLY if self.settings.again else 1.0
            found = decode_votes(heat, votes, mask, least, scale, size, model.number("nms", 0.5))
            return _moved(found, model.numbers("offset", [0.0, 0.0]), scale)
        if model.head == "rtdetr":
            return decode_rtdetr(outputs[0], classes, least, size)
        prototypes = outputs[1] if len(outputs) > 1 else None
        return decode_yolo(outputs[0], prototypes, classes, least, scale, size)

    def _run(self, values: NDArray[np.generic]) -> list[NDArray[np.float32]]:
        """The network's outputs for (n, ...) inputs, n first."""
        outputs = self.model.session.run(None, {self._input: values})
        return [np.asarray(output, dtype=np.float32) for output in outputs]


def _moved(found: Found, offset: list[float], scale: float) -> Found:
    """Boxes without the network's own constant error, known in pixels of its input."""
    shift = np.array([*offset, *offset]) / scale
    extent = np.array([found.width, found.height, found.width, found.height], dtype=np.float64)
    return replace(found, boxes=np.clip(found.boxes - shift, 0.0, extent))


def padded_size(photo: NDArray[np.uint8], scale: float) -> tuple[int, int]:
    """Rows and columns of the input: the scaled photo, rounded up to the stride."""
    inner = (max(1, round(n * scale)) for n in photo.shape[:2])
    rows, cols = (-(-n // _STRIDE) * _STRIDE for n in inner)
    return rows, cols


def prepare(photo: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """The photo at `scale` in the top left of a black image with sides multiple of 32."""
    height, width = photo.shape[:2]
    inner = (max(1, round(width * scale)), max(1, round(height * scale)))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    resized = cv2.resize(photo, inner, interpolation=method) if scale != 1 else photo
    rows, cols = padded_size(photo, scale)
    canvas = np.zeros((rows, cols, 3), np.uint8)
    canvas[: inner[1], : inner[0]] = resized
    return canvas

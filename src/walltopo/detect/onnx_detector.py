"""The default detector: an ONNX file, whole photos or tiles."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.detect.found import Found
from walltopo.detect.onnx_session import OnnxModel, open_onnx
from walltopo.detect.params import DetectSettings
from walltopo.detect.tiles import Tile, merge_tiles, tiles_of
from walltopo.detect.votes import decode_votes
from walltopo.detect.yolo import decode_rtdetr, decode_yolo, letterbox

__all__ = ["OnnxDetector"]

_STRIDE = 32  # the network halves its input five times


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
        default = 0.3 if self.model.head == "votes" else 0.25  # Ultralytics' own default
        self.score = settings.score or self.model.number("score", default)
        self._input = self.model.session.get_inputs()[0].name

    @property
    def classes(self) -> dict[int, str]:
        return self.model.classes

    @property
    def description(self) -> str:
        version = self.model.metadata.get("version", "")
        return f"{self.model.path.name} {version}".strip()

    def detect(self, photo: NDArray[np.uint8]) -> Found:
        """Objects of an (H, W, 3) uint8 RGB photo, in its pixels, best first."""
        height, width = photo.shape[:2]
        scale = self.settings.size / max(height, width)
        side = min(self.model.size) if self.model.size else self.settings.tile
        tile = max(_STRIDE, int(side / scale))
        overlap = int(self.settings.overlap / scale)
        parts: list[tuple[Tile, Found]] = []
        for window in tiles_of(width, height, tile, overlap):
            crop = photo[window.y0 : window.y1, window.x0 : window.x1]
            parts.append((window, self._look(crop, scale)))
        if len(parts) == 1:
            return parts[0][1]
        return merge_tiles(parts, width, height)

    def _look(self, photo: NDArray[np.uint8], scale: float) -> Found:
        """One tile, or the whole photo."""
        size = (photo.shape[1], photo.shape[0])
        model, classes = self.model, len(self.model.classes)
        if model.head == "votes":
            heat, votes, mask = self._run(prepare(photo, scale)[None])
            overlap = model.number("nms", 0.5)
            return decode_votes(heat, votes, mask, self.score, scale, size, overlap)
        rows, cols = model.size or padded_size(photo, scale)
        if model.head == "rtdetr":
            stretched = cv2.resize(photo, (cols, rows), interpolation=cv2.INTER_LINEAR)
            whole = letterbox(np.asarray(stretched, dtype=np.uint8), 1.0, rows, cols)
            return decode_rtdetr(self._run(whole)[0], classes, self.score, size)
        output, *rest = self._run(letterbox(photo, scale, rows, cols))
        prototypes = rest[0] if rest else None
        return decode_yolo(output, prototypes, classes, self.score, scale, size)

    def _run(self, values: NDArray[np.generic]) -> list[NDArray[np.float32]]:
        """The network's outputs for its only photo."""
        outputs = self.model.session.run(None, {self._input: values})
        return [np.asarray(output[0], dtype=np.float32) for output in outputs]


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

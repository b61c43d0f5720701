"""The default detector: an ONNX file, whole photos or tiles."""

from __future__ import annotations

from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.detect.found import Found
from walltopo.detect.onnx_session import OnnxModel, open_onnx
from walltopo.detect.params import DetectSettings
from walltopo.detect.tiles import Tile, merge_tiles, tiles_of
from walltopo.detect.votes import decode_votes

__all__ = ["OnnxDetector"]

_STRIDE = 32  # the network halves its input five times


class OnnxDetector:
    """Runs a network exported by `walltopo train` (head `votes`).

    Parameters
    ----------
    path : the ONNX file.
    settings : size, tiles, threshold, device.
    """

    def __init__(self, path: Path, settings: DetectSettings) -> None:
        self.settings = settings
        self.model: OnnxModel = open_onnx(path, settings.device, settings.threads)
        self.score = settings.score or self.model.number("score", 0.3)
        self._input = self.model.session.get_inputs()[0].name
        if self.model.head != "votes":
            raise InputError(f"{path}: head {self.model.head!r} cannot be read yet")

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
        tile = max(_STRIDE, int(self.settings.tile / scale))
        overlap = int(self.settings.overlap / scale)
        parts: list[tuple[Tile, Found]] = []
        for window in tiles_of(width, height, tile, overlap):
            crop = photo[window.y0 : window.y1, window.x0 : window.x1]
            parts.append((window, self._run(crop, scale)))
        if len(parts) == 1:
            return parts[0][1]
        return merge_tiles(parts, width, height)

    def _run(self, photo: NDArray[np.uint8], scale: float) -> Found:
        height, width = photo.shape[:2]
        heat, votes, mask = self.model.session.run(None, {self._input: prepare(photo, scale)[None]})
        return decode_votes(
            np.asarray(heat[0], dtype=np.float32),
            np.asarray(votes[0], dtype=np.float32),
            np.asarray(mask[0], dtype=np.float32),
            self.score,
            scale,
            (width, height),
            self.model.number("nms", 0.5),
        )


def prepare(photo: NDArray[np.uint8], scale: float) -> NDArray[np.uint8]:
    """The photo at `scale` in the top left of a black image with sides multiple of 32."""
    height, width = photo.shape[:2]
    inner = (max(1, round(width * scale)), max(1, round(height * scale)))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    resized = cv2.resize(photo, inner, interpolation=method) if scale != 1 else photo
    rows, cols = (-(-n // _STRIDE) * _STRIDE for n in (inner[1], inner[0]))
    canvas = np.zeros((rows, cols, 3), np.uint8)
    canvas[: inner[1], : inner[0]] = resized
    return canvas

"""The Ultralytics families (extra `[ultralytics]`, AGPL-3.0): YOLO11, RT-DETR, and SAM's masks.

These detectors are optional; the default detector needs none of them. They do not detect
holds by itself: `detect.weights` names weights that were trained on holds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Silent
from walltopo.segment.detect.photo_detections import PhotoDetections, suppress_overlaps, tight_mask
from walltopo.segment.detect.tiles import Tile, merge_tiles, tiles_of
from walltopo.segment.detect.yolo import box_masks
from walltopo.segment.settings import DetectSettings
from walltopo_lab.detectors.fetch import SAM_WEIGHTS, fetch
from walltopo_lab.extras import need_ultralytics


def _ultralytics() -> Any:
    return need_ultralytics("this detector", "export it to ONNX: --model FILE.onnx runs without")


class SamMasks:
    """Predicts masks for boxes with a Segment Anything model.

    Parameters
    ----------
    weights : the model's file; Ultralytics derives the architecture from the file name.
    device : `cpu`, `cuda` or `auto`.
    """

    def __init__(self, weights: Path, device: str = "auto") -> None:
        self._model = _ultralytics().SAM(str(weights))
        self._options = {} if device == "auto" else {"device": device}

    def masks(
        self,
        photo: NDArray[np.uint8],
        boxes: NDArray[np.float64],
        scores: NDArray[np.float64],
        labels: NDArray[np.int64],
    ) -> tuple[Mask, ...]:
        """Return one mask per box, else its inscribed ellipse; parameters as in `look`."""
        size = (photo.shape[1], photo.shape[0])
        inscribed = box_masks(boxes, scores, labels, size)
        drawn = self.look(photo, boxes, scores, labels)
        return tuple(mask or rough for mask, rough in zip(drawn, inscribed, strict=True))

    def look(
        self,
        photo: NDArray[np.uint8],
        boxes: NDArray[np.float64],
        scores: NDArray[np.float64],
        labels: NDArray[np.int64],
        points: NDArray[np.float64] | None = None,
    ) -> list[Mask | None]:
        """Return SAM's mask per box, or None; masks are cropped to the box plus a small margin.

        Parameters
        ----------
        photo : (H, W, 3) uint8, RGB.
        boxes : (n, 4) x0, y0, x1, y1 in pixels.
        points : (n, k, 2) x, y of pixels inside each object, additional prompts for SAM.
        """
        size = (photo.shape[1], photo.shape[0])
        if len(boxes) == 0:
            return []
        prompts: dict[str, Any] = {"bboxes": boxes.tolist()}
        if points is not None:
            prompts |= {
                "points": points.tolist(),
                "labels": np.ones(points.shape[:2], int).tolist(),
            }
        result = self._model(
            np.ascontiguousarray(photo[..., ::-1]),
            conf=0.0,
            verbose=False,
            **prompts,
            **self._options,
        )[0]
        drawn: list[Mask | None] = [None] * len(boxes)
        if result.masks is None:
            return drawn
        # SAM omits masks with a low score; the "class" of a mask is the index of its box.
        numbers = np.asarray(result.boxes.cls.cpu(), dtype=np.int64)
        for k, bitmap in zip(numbers, np.asarray(result.masks.data.cpu()) > 0, strict=True):
            margin = 0.1 * (boxes[k, 2:] - boxes[k, :2])
            x0, y0 = np.maximum(np.floor(boxes[k, :2] - margin), 0).astype(int)
            x1, y1 = np.minimum(np.ceil(boxes[k, 2:] + margin), size).astype(int)
            crop = np.asarray(bitmap[y0:y1, x0:x1], dtype=np.bool_)
            drawn[k] = tight_mask(crop, int(x0), int(y0), size, int(labels[k]), float(scores[k]))
        return drawn


class UltralyticsDetector:
    """A YOLO or RT-DETR network that Ultralytics itself runs.

    Parameters
    ----------
    weights : weights trained on holds (`.pt`).
    settings : size, tiles, threshold, device.
    rtdetr : whether the network is an RT-DETR instead of a YOLO.
    sam : model of the masks; None: the network's own masks, or inscribed ellipses.
    """

    def __init__(
        self,
        weights: Path,
        settings: DetectSettings,
        *,
        rtdetr: bool = False,
        sam: SamMasks | None = None,
    ) -> None:
        library = _ultralytics()
        self._name = weights.name
        self._model = library.RTDETR(str(weights)) if rtdetr else library.YOLO(str(weights))
        self._sam = sam
        self._settings = settings
        self._options = {} if settings.device == "auto" else {"device": settings.device}
        self.score = settings.score or 0.25

    @property
    def classes(self) -> dict[int, str]:
        return {int(k) + 1: str(v) for k, v in self._model.names.items()}

    @property
    def description(self) -> str:
        return f"{self._name}{' + SAM' if self._sam else ''} (Ultralytics)"

    def detect(self, photo: NDArray[np.uint8]) -> PhotoDetections:
        """Return the objects of an (H, W, 3) uint8 RGB photo, in its pixels, best score first."""
        height, width = photo.shape[:2]
        scale = self._settings.size / max(height, width)
        tile, overlap = int(self._settings.tile / scale), int(self._settings.overlap / scale)
        parts: list[tuple[Tile, PhotoDetections]] = []
        for window in tiles_of(width, height, tile, overlap):
            crop = photo[window.y0 : window.y1, window.x0 : window.x1]
            parts.append((window, self._look(np.ascontiguousarray(crop), scale)))
        found = parts[0][1] if len(parts) == 1 else merge_tiles(parts, width, height)
        if self._sam is None or len(found) == 0:
            return found
        masks = self._sam.masks(photo, found.boxes, found.scores, found.labels)
        return PhotoDetections(width, height, found.boxes, found.scores, found.labels, masks)

    def _look(self, photo: NDArray[np.uint8], scale: float) -> PhotoDetections:
        height, width = photo.shape[:2]
        side = max(32, -(-round(max(height, width) * scale) // 32) * 32)
        result = self._model.predict(
            np.ascontiguousarray(photo[..., ::-1]),
            imgsz=side,
            conf=self.score,
            retina_masks=True,
            max_det=1000,
            verbose=False,
            **self._options,
        )[0]
        boxes = np.asarray(result.boxes.xyxy.cpu(), dtype=np.float64)
        scores = np.asarray(result.boxes.conf.cpu(), dtype=np.float64)
        labels = np.asarray(result.boxes.cls.cpu(), dtype=np.int64) + 1
        kept = suppress_overlaps(boxes, scores, labels, 0.7, 0.8)
        boxes, scores, labels = boxes[kept], np.clip(scores[kept], 1e-6, 1.0), labels[kept]
        masks = box_masks(boxes, scores, labels, (width, height))
        if result.masks is not None and self._sam is None:
            bitmaps = np.asarray(result.masks.data.cpu())[kept] > 0
            masks = tuple(
                tight_mask(b, 0, 0, (width, height), m.label, m.score) or m
                for b, m in zip(bitmaps, masks, strict=True)
            )
        return PhotoDetections(width, height, boxes, scores, labels, masks)


def open_family(name: str, settings: DetectSettings) -> UltralyticsDetector:
    """Return the detector `yolo11-seg`, `yolo11-sam` or `rtdetr-sam` with the configured weights.

    Raises
    ------
    EnvironmentLacksError : the extra is not installed, or SAM's weights cannot be fetched.
    InputError : no weights are configured, or the file does not exist.
    """
    _ultralytics()
    weights = Path(settings.weights)
    if not settings.weights or not weights.is_file():
        raise InputError(
            f"{name} needs weights trained on holds, "
            + (f"but {weights} does not exist" if settings.weights else "and none are named"),
            "Name them with --weights FILE.pt (setting detect.weights).",
        )
    sam = None
    if name.endswith("-sam"):
        sam = SamMasks(fetch(SAM_WEIGHTS[settings.sam], Silent()), settings.device)
    return UltralyticsDetector(weights, settings, rtdetr=name.startswith("rtdetr"), sam=sam)

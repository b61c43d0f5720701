"""The Ultralytics families (extra `[ultralytics]`, AGPL-3.0): YOLO11, RT-DETR, and SAM's masks.

They are there for those who choose them; the default needs nothing of this. None of them knows
holds by itself: `detect.weights` names weights that were trained on holds.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask, Silent
from walltopo.segment.detect.found import Found, keep_best, tight_mask
from walltopo.segment.detect.settings import DetectSettings
from walltopo.segment.detect.tiles import Tile, merge_tiles, tiles_of
from walltopo.segment.detect.yolo import box_masks
from walltopo_lab.detectors.fetch import SAM_WEIGHTS, fetch
from walltopo_lab.extras import need_ultralytics


def _ultralytics() -> Any:
    return need_ultralytics("this detector", "export it to ONNX: --model FILE.onnx runs without")


class SamMasks:
    """Masks for boxes, by a Segment Anything model.

    Parameters
    ----------
    weights : the model's file; Ultralytics tells the architecture from its name.
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
        """One mask per box; its ellipse where SAM has none. Parameters as in `look`."""
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
        """SAM's mask per box, cropped to a little more than the box; None where it has none.

        Parameters
        ----------
        photo : (H, W, 3) uint8, RGB.
        boxes : (n, 4) x0, y0, x1, y1 in pixels.
        points : (n, k, 2) x, y of pixels that belong to each object, told to SAM too.
        """
        size = (photo.shape[1], photo.shape[0])
        if len(boxes) == 0:
            return []
        told: dict[str, Any] = {"bboxes": boxes.tolist()}
        if points is not None:
            told |= {"points": points.tolist(), "labels": np.ones(points.shape[:2], int).tolist()}
        result = self._model(
            np.ascontiguousarray(photo[..., ::-1]), conf=0.0, verbose=False, **told, **self._options
        )[0]
        drawn: list[Mask | None] = [None] * len(boxes)
        if result.masks is None:
            return drawn
        # SAM leaves out what it thinks nothing of; the "class" of a mask is the number of its box.
        asked = np.asarray(result.boxes.cls.cpu(), dtype=np.int64)
        for k, bitmap in zip(asked, np.asarray(result.masks.data.cpu()) > 0, strict=True):
            margin = 0.1 * (boxes[k, 2:] - boxes[k, :2])
            x0, y0 = np.maximum(np.floor(boxes[k, :2] - margin), 0).astype(int)
            x1, y1 = np.minimum(np.ceil(boxes[k, 2:] + margin), size).astype(int)
            crop = np.asarray(bitmap[y0:y1, x0:x1], dtype=np.bool_)
            drawn[k] = tight_mask(crop, int(x0), int(y0), size, int(labels[k]), float(scores[k]))
        return drawn


class UltralyticsDetector:
    """A YOLO or RT-DETR network run by Ultralytics itself.

    Parameters
    ----------
    weights : weights trained on holds (`.pt`).
    settings : size, tiles, threshold, device.
    rtdetr : the architecture's family.
    sam : gives the masks; without it the network's own, or inscribed ellipses.
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

    def detect(self, photo: NDArray[np.uint8]) -> Found:
        """Objects of an (H, W, 3) uint8 RGB photo, in its pixels, best first."""
        height, width = photo.shape[:2]
        scale = self._settings.size / max(height, width)
        tile, overlap = int(self._settings.tile / scale), int(self._settings.overlap / scale)
        parts: list[tuple[Tile, Found]] = []
        for window in tiles_of(width, height, tile, overlap):
            crop = photo[window.y0 : window.y1, window.x0 : window.x1]
            parts.append((window, self._look(np.ascontiguousarray(crop), scale)))
        found = parts[0][1] if len(parts) == 1 else merge_tiles(parts, width, height)
        if self._sam is None or len(found) == 0:
            return found
        masks = self._sam.masks(photo, found.boxes, found.scores, found.labels)
        return Found(width, height, found.boxes, found.scores, found.labels, masks)

    def _look(self, photo: NDArray[np.uint8], scale: float) -> Found:
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
        kept = keep_best(boxes, scores, labels, 0.7, 0.8)
        boxes, scores, labels = boxes[kept], np.clip(scores[kept], 1e-6, 1.0), labels[kept]
        masks = box_masks(boxes, scores, labels, (width, height))
        if result.masks is not None and self._sam is None:
            bitmaps = np.asarray(result.masks.data.cpu())[kept] > 0
            masks = tuple(
                tight_mask(b, 0, 0, (width, height), m.label, m.score) or m
                for b, m in zip(bitmaps, masks, strict=True)
            )
        return Found(width, height, boxes, scores, labels, masks)


def open_family(name: str, settings: DetectSettings) -> UltralyticsDetector:
    """`yolo11-seg`, `yolo11-sam` or `rtdetr-sam` with the weights the settings name.

    Raises
    ------
    EnvironmentLacksError : the extra is not installed, or SAM's weights cannot be fetched.
    InputError : no weights, or they cannot be read.
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

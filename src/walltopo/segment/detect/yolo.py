"""Decode the outputs of networks that Ultralytics exports: YOLO boxes, YOLO masks, RT-DETR.

Formats as in Ultralytics' documentation of its ONNX export (YOLOv8, YOLO11; RT-DETR):

- boxes: (4 + C, N), each column x, y, w, h in input pixels, then the class scores; or, exported
  with `nms=True`, (N, 6) rows x0, y0, x1, y1, score, class;
- masks: the same with K mask coefficients below the scores, and K prototypes (K, H/4, W/4);
- RT-DETR: (N, 4 + C) rows, x, y, w, h relative to the input.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask
from walltopo.segment.detect.photo_detections import PhotoDetections, suppress_overlaps, tight_mask

Floats = NDArray[np.float32]
_GREY = 114  # Ultralytics pads with this grey in training


def letterbox(photo: NDArray[np.uint8], scale: float, rows: int, cols: int) -> Floats:
    """Return the photo at `scale` in the top left of a grey (1, 3, rows, cols) float32 image.

    Values are in [0, 1].
    """
    height, width = photo.shape[:2]
    inner = (min(cols, max(1, round(width * scale))), min(rows, max(1, round(height * scale))))
    method = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    canvas = np.full((rows, cols, 3), _GREY, np.uint8)
    canvas[: inner[1], : inner[0]] = cv2.resize(photo, inner, interpolation=method)
    return np.ascontiguousarray(canvas.transpose(2, 0, 1)[None], dtype=np.float32) / 255.0


def _corners(xywh: NDArray[np.float64]) -> NDArray[np.float64]:
    half = xywh[:, 2:] / 2
    return np.concatenate([xywh[:, :2] - half, xywh[:, :2] + half], axis=1)


def _split_output(
    output: Floats, classes: int, coefficients: int
) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int64], Floats]:
    """Return corners (n, 4), scores, labels (from 1) and mask coefficients (n, K) of one photo."""
    if output.ndim != 2:
        raise InputError(f"YOLO output: expected two axes per photo, got {output.shape}")
    # With nms=True the rows are corners, score, class and mask coefficients, and there are at most
    # a few hundred of them. Raw outputs have thousands of columns.
    if output.shape[1] == 6 + coefficients and output.shape[0] != 4 + classes + coefficients:
        boxes = output[:, :4].astype(np.float64)
        labels = output[:, 5].astype(np.int64) + 1
        return boxes, output[:, 4].astype(np.float64), labels, output[:, 6:]
    if output.shape[0] != 4 + classes + coefficients:
        raise InputError(
            f"YOLO output: expected {4 + classes + coefficients} rows for {classes} classes and "
            f"{coefficients} mask coefficients, got {output.shape[0]}"
        )
    columns = output.T
    scores = columns[:, 4 : 4 + classes]
    labels = scores.argmax(axis=1).astype(np.int64)
    best = scores[np.arange(len(scores)), labels].astype(np.float64)
    return _corners(columns[:, :4].astype(np.float64)), best, labels + 1, columns[:, 4 + classes :]


def _keep_boxes(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    labels: NDArray[np.int64],
    threshold: float,
    overlap: float,
    size: tuple[int, int],
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the positions of the boxes to keep, highest score first, and these boxes clipped."""
    above = np.flatnonzero(scores >= threshold)
    boxes = np.clip(boxes, 0.0, [size[0], size[1], size[0], size[1]])
    above = above[np.prod(boxes[above, 2:] - boxes[above, :2], axis=1) > 0]
    kept = above[suppress_overlaps(boxes[above], scores[above], labels[above], overlap)]
    return kept, boxes[kept]


def _prototype_mask(
    field: Floats, box: NDArray[np.float64], step: float, size: tuple[int, int]
) -> tuple[NDArray[np.bool_], int, int]:
    """Return a mask within a box of the photo, from logits, and the mask's column and row."""
    x0, y0 = (max(0, int(np.floor(v))) for v in box[:2])
    x1, y1 = min(size[0], int(np.ceil(box[2]))), min(size[1], int(np.ceil(box[3])))
    matrix = np.array([[step, 0, (x0 + 0.5) * step - 0.5], [0, step, (y0 + 0.5) * step - 0.5]])
    logits = cv2.warpAffine(
        field,
        matrix,
        (x1 - x0, y1 - y0),
        flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )
    return np.asarray(logits > 0), x0, y0


def box_masks(
    boxes: NDArray[np.float64],
    scores: NDArray[np.float64],
    labels: NDArray[np.int64],
    size: tuple[int, int],
) -> tuple[Mask, ...]:
    """Return the ellipse inscribed in each box as its mask, for networks without masks."""
    masks = []
    for box, score, label in zip(boxes, scores, labels, strict=True):
        x0, y0 = (max(0, int(np.floor(v))) for v in box[:2])
        x1 = min(size[0], max(x0 + 1, int(np.ceil(box[2]))))
        y1 = min(size[1], max(y0 + 1, int(np.ceil(box[3]))))
        middle, half = (box[:2] + box[2:]) / 2, np.maximum((box[2:] - box[:2]) / 2, 0.5)
        u = (np.arange(x0, x1) + 0.5 - middle[0]) / half[0]
        v = (np.arange(y0, y1) + 0.5 - middle[1]) / half[1]
        inside = u[None, :] ** 2 + v[:, None] ** 2 <= 1
        masks.append(Mask(inside, x0, y0, size[0], size[1], int(label), float(min(score, 1.0))))
    return tuple(masks)


def decode_yolo(
    output: Floats,
    prototypes: Floats | None,
    classes: int,
    threshold: float,
    scale: float,
    size: tuple[int, int],
    overlap: float = 0.6,
) -> PhotoDetections:
    """Return the objects of one photo from the output of a YOLO network.

    Parameters
    ----------
    output : (4 + C + K, N) or (N, 6 + K), see the module's docstring.
    prototypes : (K, h, w), or None for a network without masks.
    scale : input pixels per photo pixel; the photo lies in the input's top left.
    size : width and height of the photo.

    Returns
    -------
    The objects in photo pixels; without prototypes the masks are inscribed ellipses.
    """
    coefficients = 0 if prototypes is None else prototypes.shape[0]
    boxes, scores, labels, weights = _split_output(output, classes, coefficients)
    kept, clipped = _keep_boxes(boxes / scale, scores, labels, threshold, overlap, size)
    scores, labels = np.clip(scores[kept], 1e-6, 1.0), labels[kept]
    if prototypes is None:
        masks = box_masks(clipped, scores, labels, size)
        return PhotoDetections(size[0], size[1], clipped, scores, labels, masks)
    fields = np.tensordot(weights[kept], prototypes, axes=1)
    drawn: list[Mask] = []
    seen: list[int] = []
    for k in range(len(kept)):
        # Prototypes are a quarter of the input's resolution.
        bitmap, x, y = _prototype_mask(fields[k], clipped[k], scale / 4, size)
        mask = tight_mask(bitmap, x, y, size, int(labels[k]), float(scores[k]))
        if mask is not None:
            seen.append(k)
            drawn.append(mask)
    index = np.asarray(seen, dtype=np.int64)
    return PhotoDetections(
        size[0], size[1], clipped[index], scores[index], labels[index], tuple(drawn)
    )


def decode_rtdetr(
    output: Floats, classes: int, threshold: float, size: tuple[int, int]
) -> PhotoDetections:
    """Return the objects of one photo from RT-DETR, whose input is the stretched photo.

    Parameters
    ----------
    output : (N, 4 + C), relative x, y, w, h, then class scores.
    """
    if output.ndim != 2 or output.shape[1] != 4 + classes:
        raise InputError(f"RT-DETR output: expected (n, {4 + classes}), got {output.shape}")
    extent = np.array([size[0], size[1], size[0], size[1]], dtype=np.float64)
    boxes = _corners(output[:, :4].astype(np.float64)) * extent
    labels = output[:, 4:].argmax(axis=1).astype(np.int64)
    scores = output[np.arange(len(output)), 4 + labels].astype(np.float64)
    kept, clipped = _keep_boxes(boxes, scores, labels + 1, threshold, 0.9, size)
    scores, labels = np.clip(scores[kept], 1e-6, 1.0), labels[kept] + 1
    return PhotoDetections(
        size[0], size[1], clipped, scores, labels, box_masks(clipped, scores, labels, size)
    )

"""Augmented training crops from labelled photos: a random similarity and random colours."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo_lab.train.cache import Sample
from walltopo_lab.train.params import AugmentSettings


@dataclass(frozen=True, eq=False)
class Crop:
    """A square augmented crop of a photo.

    Parameters
    ----------
    image : (S, S, 3) uint8, RGB.
    ids : (S, S) int16, as in `Sample`; 0 beyond the photo's border.
    labels : (n,) int, 1 hold, 2 volume.
    boxes : (n, 4) float64, x0, y0, x1, y1 in the crop, clipped to it.
    seen : (n,) float64, share of the whole box that lies in the crop.
    """

    image: NDArray[np.uint8]
    ids: NDArray[np.int16]
    labels: NDArray[np.int64]
    boxes: NDArray[np.float64]
    seen: NDArray[np.float64]


def _random_similarity(
    sample: Sample, side: int, settings: AugmentSettings, rng: np.random.Generator
) -> NDArray[np.float64]:
    """Return a random (2, 3) similarity from photo to crop.

    It combines scale, rotation and reflection, and centres a random object or position.
    """
    height, width = sample.image.shape[:2]
    scale = math.exp(rng.uniform(math.log(settings.scale_low), math.log(settings.scale_high)))
    # A tiny photo would fill only a corner of the crop; of a huge one it would show three holds.
    scale *= float(np.clip(1067.0 / max(height, width), 0.6, 2.5)) ** 0.7
    turn = rng.uniform(-1, 1) * (180.0 if rng.random() < settings.turn_share else settings.rotation)
    angle = math.radians(turn)
    linear = scale * np.array(
        [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    )
    if rng.random() < settings.flip:
        linear[:, 0] *= -1
    if rng.random() < settings.flip_vertical:
        linear[1] *= -1
    if len(sample.boxes) and rng.random() < 0.7:
        # Only a tenth of the objects are volumes: oversample them as crop centres.
        volumes = np.flatnonzero(sample.labels == 2)
        among = volumes if len(volumes) and rng.random() < 0.4 else np.arange(len(sample.boxes))
        box = sample.boxes[rng.choice(among)]
        middle = (box[:2] + box[2:]) / 2
    else:
        middle = rng.uniform(0.15, 0.85, 2) * [width, height]
    target = np.full(2, side / 2) + rng.uniform(-1, 1, 2) * settings.translation * side
    return np.concatenate([linear, (target - linear @ middle)[:, None]], axis=1)


def shift_colours(
    image: NDArray[np.uint8], settings: AugmentSettings, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Vary hue, saturation and brightness of an RGB image; sometimes blur, noise, JPEG."""
    hsv = cv2.cvtColor(image, cv2.COLOR_RGB2HSV)
    steps = np.arange(256)
    shift = settings.hue * rng.uniform(0, 180) if rng.random() < settings.hue_share else 0.0
    shift += rng.normal(0, 3) if settings.hue else 0.0
    gamma = math.exp(rng.normal(0, 0.25)) if settings.value else 1.0
    tables = (
        ((steps + shift) % 180).astype(np.uint8),
        np.clip(steps * (1 + settings.saturation * rng.uniform(-1, 0.7)), 0, 255).astype(np.uint8),
        np.clip(
            255 * (steps / 255) ** gamma * (1 + settings.value * rng.uniform(-1, 0.7)),
            0,
            255,
        ).astype(np.uint8),
    )
    for k, table in enumerate(tables):
        hsv[..., k] = cv2.LUT(hsv[..., k], table)
    image = np.asarray(cv2.cvtColor(hsv, cv2.COLOR_HSV2RGB), dtype=np.uint8)
    if rng.random() < 0.04 * (settings.saturation > 0):
        grey = cv2.cvtColor(image, cv2.COLOR_RGB2GRAY)
        image = np.repeat(grey[..., None], 3, axis=2)
    if rng.random() < settings.degrade:
        kind = rng.integers(3)
        if kind == 0:
            blurred = cv2.GaussianBlur(image, (0, 0), float(rng.uniform(0.5, 1.5)))
            image = np.asarray(blurred, dtype=np.uint8)
        elif kind == 1:
            noise = rng.normal(0, rng.uniform(3, 12), image.shape).astype(np.float32)
            image = np.clip(image + noise, 0, 255).astype(np.uint8)
        else:
            quality = int(rng.integers(25, 70))
            _, data = cv2.imencode(".jpg", image, [cv2.IMWRITE_JPEG_QUALITY, quality])
            image = np.asarray(cv2.imdecode(data, cv2.IMREAD_COLOR), dtype=np.uint8)
    return np.asarray(image, dtype=np.uint8)


def crop_sample(
    sample: Sample, side: int, settings: AugmentSettings, rng: np.random.Generator
) -> Crop:
    """Return a random crop of `side` px, with the boxes of the objects in it."""
    matrix = _random_similarity(sample, side, settings, rng)
    # The matrix maps pixel corners, as boxes use; OpenCV's maps pixel centres.
    pixels = matrix.copy()
    pixels[:, 2] += matrix[:, :2] @ [0.5, 0.5] - 0.5
    shrink = np.hypot(*matrix[:, 0]) < 0.7
    blank = int(rng.integers(256))
    image = cv2.warpAffine(
        sample.image,
        pixels,
        (side, side),
        flags=cv2.INTER_AREA if shrink else cv2.INTER_LINEAR,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=(blank,) * 3,
    )
    ids = cv2.warpAffine(
        sample.ids,
        pixels,
        (side, side),
        flags=cv2.INTER_NEAREST,
        borderMode=cv2.BORDER_CONSTANT,
        borderValue=0,
    )
    image = cv2.cvtColor(image, cv2.COLOR_BGR2RGB)
    image = shift_colours(np.asarray(image, dtype=np.uint8), settings, rng)
    hulls = sample.hulls.astype(np.float64) @ matrix[:, :2].T + matrix[:, 2]
    boxes = np.concatenate([hulls.min(axis=1), hulls.max(axis=1)], axis=1).reshape(-1, 4)
    everything = Crop(
        image, np.asarray(ids, dtype=np.int16), sample.labels, boxes, np.ones(len(boxes))
    )
    extent = np.ceil(side * rng.uniform(settings.crop_fraction, 1.0, 2)).astype(int)
    x0, y0 = (int(v) for v in rng.integers(0, side - extent + 1))
    window = (x0, y0, x0 + int(extent[0]), y0 + int(extent[1]))
    return _assemble_mosaic([(everything, window)], blank)


def mosaic(crops: Sequence[Crop], rng: np.random.Generator) -> Crop:
    """Return a mosaic of four crops: each fills one of the quarters around a random centre."""
    if len(crops) != 4:
        raise InputError(f"a mosaic is of 4 crops, not of {len(crops)}")
    side = crops[0].image.shape[0]
    x, y = (int(v) for v in rng.integers(round(0.3 * side), round(0.7 * side) + 1, 2))
    windows = ((0, 0, x, y), (x, 0, side, y), (0, y, x, side), (x, y, side, side))
    return _assemble_mosaic(list(zip(crops, windows, strict=True)), 0)


def _assemble_mosaic(parts: Sequence[tuple[Crop, tuple[int, int, int, int]]], blank: int) -> Crop:
    """Combine crops of one size into one, each visible only in its window x0, y0, x1, y1."""
    image = np.full_like(parts[0][0].image, blank)
    ids = np.zeros_like(parts[0][0].ids)
    boxes, seen, count = [], [], 0
    for crop, (x0, y0, x1, y1) in parts:
        image[y0:y1, x0:x1] = crop.image[y0:y1, x0:x1]
        mine = crop.ids[y0:y1, x0:x1]
        ids[y0:y1, x0:x1] = np.where(mine > 0, mine + count, mine)
        count += len(crop.labels)
        clipped = np.clip(crop.boxes, [x0, y0, x0, y0], [x1, y1, x1, y1])
        before = np.prod(crop.boxes[:, 2:] - crop.boxes[:, :2], axis=1)
        after = np.prod(clipped[:, 2:] - clipped[:, :2], axis=1)
        boxes.append(clipped)
        seen.append(crop.seen * after / np.maximum(before, 1e-6))
    labels = np.concatenate([crop.labels for crop, _ in parts])
    return Crop(image, ids, labels, np.concatenate(boxes), np.concatenate(seen))

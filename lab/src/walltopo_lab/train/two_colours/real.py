"""Views of holds in real photos: nearly all have one colour, and some get a second one here."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Progress
from walltopo.describe.classify.two_colours import SIDE, frame_view, large_views
from walltopo.images.files import read_rgb
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.settings import DetectSettings
from walltopo_lab.train.photo_holds import photo_views
from walltopo_lab.train.two_colours.views import PartedViews

MIN_APART = 0.3  # of two paints that count as two, as in generated gyms
SHARES = (0.15, 0.5)  # of the second colour
BLOBS = 0.3  # share of the second colours that are no straight cut
TEXTURE = 0.7  # of the deviations from a part's mean that its new colour keeps
_EDGE = 0.7  # pixels over which one colour turns into the other
_PAINT = slice(0, 3)  # channels: two of paint, and lightness
_MASK = 3

Float32s = NDArray[np.float32]


def read_photo_views(photos: Sequence[Path], progress: Progress) -> list[Float32s]:
    """Return for each photo the (n, CHANNELS, SIDE, SIDE) pictures of its holds."""
    detector = open_detector(DetectSettings())
    progress.step("holds of real photos", len(photos))
    pictures = []
    for path in photos:
        seen = photo_views(read_rgb(path), detector)
        rows = [row for view in seen.views.values() for row in large_views(view)]
        if rows:
            pictures.append(np.stack([frame_view(row, seen.light) for row in rows]))
        progress.advance()
    return pictures


def one_coloured(pictures: Float32s) -> PartedViews:
    """Return pictures as views of holds with one colour."""
    count = len(pictures)
    parts = np.zeros((count, SIDE, SIDE), dtype=np.float32)
    return PartedViews(np.arange(count), pictures, parts, np.zeros(count), np.zeros(count))


def recoloured(pictures: Float32s, rng: np.random.Generator) -> PartedViews:
    """Return the pictures in which a part has the paint of another hold of the same photos.

    Chalk, shade and what a mask has too much stay, so that they tell nothing about two colours.
    Holds without a paint that differs enough from theirs are left out.
    """
    cover = pictures[:, _MASK]
    means = _means(pictures, cover)
    made, parts, shares = [], [], []
    for row, picture in enumerate(pictures):
        other = means[rng.integers(len(means))]
        part = _second_part(cover[row], rng)
        share = float((part * cover[row]).sum() / max(float(cover[row].sum()), 1e-6))
        if np.linalg.norm(other - means[row]) < MIN_APART or not 0.08 < share < 0.92:
            continue
        paint = picture[_PAINT]
        own = (paint * part * cover[row]).sum((1, 2)) / max(float((part * cover[row]).sum()), 1e-6)
        repainted = other[:, None, None] + TEXTURE * (paint - own[:, None, None])
        new = picture.copy()
        new[_PAINT] = np.where(cover[row] > 0.05, paint + part * (repainted - paint), 0.0)
        made.append(new)
        parts.append(part)
        shares.append(share)
    second = np.array(shares)
    return PartedViews(np.arange(len(made)), np.stack(made), np.stack(parts), second, second)


def _means(pictures: Float32s, cover: Float32s) -> Float32s:
    """Return the (n, 3) mean paint and lightness of each picture."""
    total = np.maximum(cover.sum((1, 2)), 1e-6)[:, None]
    return np.asarray((pictures[:, _PAINT] * cover[:, None]).sum((2, 3)) / total)


def _second_part(cover: Float32s, rng: np.random.Generator) -> Float32s:
    """Return the (SIDE, SIDE) share of each pixel in the second colour: a cut, or blobs."""
    y, x = np.mgrid[:SIDE, :SIDE].astype(np.float32)
    if rng.random() < BLOBS:
        noise = rng.normal(size=(SIDE, SIDE)).astype(np.float32)
        smooth = np.asarray(cv2.GaussianBlur(noise, (0, 0), float(rng.uniform(3, 6))))
        level = (smooth * (4 / max(float(smooth.std()), 1e-6))).astype(np.float32)
    else:
        angle = rng.uniform(0, 2 * np.pi)
        level = (np.cos(angle) * x + np.sin(angle) * y).astype(np.float32)
    inside = level[cover > 0.5]
    if not len(inside):
        return np.zeros_like(cover)
    limit = np.quantile(inside, 1 - rng.uniform(*SHARES))
    return np.asarray(1 / (1 + np.exp(-(level - limit) / _EDGE)), dtype=np.float32)

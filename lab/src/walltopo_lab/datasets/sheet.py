"""A contact sheet of photos with their labels drawn."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.shapes import polygons_of
from walltopo_lab.plots import COLOURS


def draw_labels(photo: Photo, long_side: int) -> NDArray[np.uint8]:
    """Return the photo, at most `long_side` pixels long, with outlines in a colour per class."""
    import cv2
    from PIL import ImageColor

    pixels = photo.pixels()
    factor = min(1.0, long_side / max(pixels.shape[:2]))
    size = (round(pixels.shape[1] * factor), round(pixels.shape[0] * factor))
    image = cv2.resize(pixels, size, interpolation=cv2.INTER_AREA)
    tinted = image.copy()
    for annotation in photo.annotations:
        colour = ImageColor.getrgb(COLOURS[annotation.label % len(COLOURS)])
        lines = [np.round(p * factor).astype(np.int32) for p in polygons_of(annotation, photo)]
        if annotation.has_shape:
            cv2.fillPoly(tinted, lines, colour)
        cv2.polylines(image, lines, True, colour, 1 if long_side < 800 else 2, cv2.LINE_AA)
    return np.asarray(cv2.addWeighted(image, 0.65, tinted, 0.35, 0), dtype=np.uint8)


def write_sheet(
    path: Path, dataset: Dataset, names: Sequence[str] = (), count: int = 12, cell: int = 480
) -> int:
    """Write a PNG of `count` photos spread over the set, or of the named ones.

    Returns
    -------
    The number of photos on the sheet.
    """
    from PIL import Image, ImageDraw

    photos = [p for p in dataset.photos if p.path is not None or p.embedded is not None]
    if names:
        photos = [p for p in photos if p.name in set(names)]
    elif len(photos) > count:
        photos = [photos[k] for k in np.linspace(0, len(photos) - 1, count).astype(int)]
    columns = max(1, math.ceil(math.sqrt(len(photos) * 0.75)))
    rows = max(1, math.ceil(len(photos) / columns))
    sheet = Image.new("RGB", (columns * cell, rows * (cell + 18)), (255, 255, 255))
    draw = ImageDraw.Draw(sheet)
    for k, photo in enumerate(photos):
        x, y = (k % columns) * cell, (k // columns) * (cell + 18)
        sheet.paste(Image.fromarray(draw_labels(photo, cell - 4)), (x, y + 16))
        draw.text((x + 2, y + 2), f"{photo.name[:56]}  ({len(photo.annotations)})", fill=(0, 0, 0))
    with atomic_path(path) as temporary:
        sheet.save(temporary, format="PNG")
    return len(photos)

"""A photo or another picture in a file as an array, decoded by OpenCV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.imaging.hush import hushed

__all__ = ["read_grey", "read_rgb"]


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W, 3) uint8 RGB.

    Raises
    ------
    InputError : the file is missing, or damaged, or no picture; names it.
    """
    import cv2

    return np.ascontiguousarray(_read(path, cv2.IMREAD_COLOR)[..., ::-1])


def read_grey(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W) uint8, grey by OpenCV's weights.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return _read(path, cv2.IMREAD_GRAYSCALE)


def _read(path: Path, mode: int) -> NDArray[np.uint8]:
    import cv2

    if not path.is_file():
        raise InputError(f"{path}: no such picture", _HINT)
    with hushed():
        picture = cv2.imread(str(path), mode)
    if picture is None:
        raise InputError(f"{path}: not a picture, or damaged", _HINT)
    return np.asarray(picture, dtype=np.uint8)


_HINT = "If it is a scan's own photo, run the scan again: walltopo scan --from ingest."

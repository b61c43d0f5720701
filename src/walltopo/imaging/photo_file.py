"""A photo or another picture in a file as an array, decoded by OpenCV."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.imaging.hush import hushed
from walltopo.imaging.opening import open_picture

__all__ = ["read_grey", "read_rgb", "read_stored"]


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W, 3) uint8 RGB.

    Raises
    ------
    InputError : the file is missing, or damaged, or no picture; names it.
    """
    import cv2

    picture = _read(path, cv2.IMREAD_COLOR)[..., ::-1]
    return np.ascontiguousarray(picture, dtype=np.uint8)


def read_grey(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W) uint8, grey by OpenCV's weights.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return np.asarray(_read(path, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def read_stored(path: Path) -> NDArray[np.generic]:
    """A picture as it is stored: (H, W) or (H, W, C in BGR order), of the file's own depth.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return _read(path, cv2.IMREAD_UNCHANGED)


def _read(path: Path, mode: int) -> NDArray[np.generic]:
    import cv2

    if not path.is_file():
        raise InputError(f"{path}: no such picture", _HINT)
    try:
        # OpenCV decodes more formats than are let in, and up to a billion pixels.
        with open_picture(path), hushed():
            picture = cv2.imread(str(path), mode)
    except InputError as error:
        raise InputError(f"{path}: {error.message}", _HINT) from error
    if picture is None:
        raise InputError(f"{path}: not a picture, or damaged", _HINT)
    return np.asarray(picture)


_HINT = "If it is a scan's own photo, run the scan again: walltopo scan --from ingest."

"""Is a photo usable: sharpness, and sameness with another."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["LEAST_SHARPNESS", "motion", "sharpness", "thumbnail"]

LEAST_SHARPNESS = 3.0  # below it no photo of a wall is any use

_SHARPNESS_WIDTH = 1024


def sharpness(rgb: NDArray[np.uint8]) -> float:
    """Variance of the Laplacian of the grey image reduced to 1024 px.

    Source: Pech-Pacheco et al., "Diatom autofocusing in brightfield microscopy" (2000).

    Parameters
    ----------
    rgb : (H, W, 3) uint8.
    """
    import cv2

    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    factor = _SHARPNESS_WIDTH / max(grey.shape)
    if factor < 1.0:
        grey = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return float(cv2.Laplacian(grey, cv2.CV_64F).var())


def thumbnail(rgb: NDArray[np.uint8], size: int = 64) -> NDArray[np.float32]:
    """A (size, size) grey picture for comparing photos, values 0 to 255."""
    import cv2

    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32)


def motion(before: NDArray[np.float32], after: NDArray[np.float32]) -> float:
    """Shift between two thumbnails as a share of their width (phase correlation)."""
    import cv2

    window = cv2.createHanningWindow((before.shape[1], before.shape[0]), cv2.CV_32F)
    (dx, dy), _ = cv2.phaseCorrelate(before, after, window)
    return float(np.hypot(dx, dy) / before.shape[1])

"""OKLab, and the shading-free colour features built on it.

Source: B. Ottosson, "A perceptual color space for image processing" (OKLab), 2020.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["DARK", "features", "oklab_from_linear"]

Floats = NDArray[np.float64]

_LMS = np.array(
    [
        [0.4122214708, 0.5363325363, 0.0514459929],
        [0.2119034982, 0.6806995451, 0.1073969566],
        [0.0883024619, 0.2817188376, 0.6299787005],
    ]
)
_LAB = np.array(
    [
        [0.2104542553, 0.7936177850, -0.0040720468],
        [1.9779984951, -2.4285922050, 0.4505937099],
        [0.0259040371, 0.7827717662, -0.8086757660],
    ]
)

# Saturation a/L, b/L of a vivid blue is twice that of a vivid red; r / (r + KNEE) evens out.
KNEE = 0.35
# Lightness below which a/L, b/L are noise, and are held down.
DARK = 0.06


def oklab_from_linear(linear: Floats) -> Floats:
    """(..., 3) OKLab (L, a, b) of (..., 3) linear RGB; L = 1 for white."""
    return np.cbrt(np.maximum(linear, 0.0) @ _LMS.T) @ _LAB.T


def features(linear: Floats, lightness_weight: float) -> Floats:
    """(..., 3) features in which Euclidean distance compares paint, not light.

    OKLab scales as a whole when light is scaled, so a/L and b/L are free of shading. They are
    compressed radially (see `KNEE`). The third feature is lightness with a lower weight: it
    is what tells black, grey and white, but shading changes it.
    """
    lab = oklab_from_linear(linear)
    lightness = lab[..., :1]
    paint = lab[..., 1:] / (np.maximum(lightness, 0.0) + DARK)
    radius = np.linalg.norm(paint, axis=-1, keepdims=True)
    return np.concatenate([paint / (radius + KNEE), lightness * lightness_weight], axis=-1)

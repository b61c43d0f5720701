"""Convert between sRGB, linear light and Oklab."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def linear_from_srgb(coded: Floats) -> Floats:
    """Convert sRGB values in [0, 1] to linear light in [0, 1]."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """Convert linear light >= 0 to sRGB, same type; light beyond white stays above 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_LINEAR_OF_CODES = linear_from_srgb(np.arange(256) / 255.0)


def linear_from_srgb8(pixels: NDArray[np.uint8]) -> Floats:
    """Convert 8-bit sRGB values to linear light in [0, 1], float64."""
    return _LINEAR_OF_CODES[pixels]


def linear32_from_srgb8(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """Convert 8-bit sRGB values to linear light in [0, 1], float32 to save memory."""
    return _LINEAR_OF_CODES.astype(np.float32)[pixels]


def srgb8_from_linear(linear: Floats) -> NDArray[np.uint8]:
    """Convert linear light to 8-bit sRGB; values outside [0, 1] are clipped."""
    return np.round(srgb_from_linear(np.clip(linear, 0.0, 1.0)) * 255).astype(np.uint8)


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

# The saturation a/L, b/L of a vivid blue is twice that of a vivid red; r / (r + KNEE) equalises.
KNEE = 0.35

# Offset of the lightness; it damps a/L and b/L in dark colours, where they are noise.
DARK = 0.06


def oklab_from_linear(linear: Floats) -> Floats:
    """Convert linear RGB (..., 3) to Oklab (L, a, b); L = 1 for white."""
    return np.cbrt(np.maximum(linear, 0.0) @ _LMS.T) @ _LAB.T


def features(linear: Floats, lightness_weight: float) -> Floats:
    """Return (..., 3) features in which Euclidean distance compares paint instead of light.

    Oklab scales with the light, so a/L and b/L are independent of shading. They are
    compressed radially (see `KNEE`). The third feature is lightness with a lower weight: it
    separates black, grey and white, but shading changes it.
    """
    lab = oklab_from_linear(linear)
    lightness = lab[..., :1]
    paint = lab[..., 1:] / (np.maximum(lightness, 0.0) + DARK)
    radius = np.linalg.norm(paint, axis=-1, keepdims=True)
    return np.concatenate([paint / (radius + KNEE), lightness * lightness_weight], axis=-1)

"""sRGB, linear light and Oklab."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def linear_from_srgb(coded: Floats) -> Floats:
    """Linear light in [0, 1] of sRGB values in [0, 1], same shape."""
    return np.where(coded <= 0.04045, coded / 12.92, ((coded + 0.055) / 1.055) ** 2.4)


def srgb_from_linear(linear: NDArray[np.floating]) -> NDArray[np.floating]:
    """sRGB of linear light >= 0, same shape and type; light beyond white stays beyond 1."""
    return np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1 / 2.4) - 0.055)


_LINEAR_OF_CODES = linear_from_srgb(np.arange(256) / 255.0)


def linear_from_srgb8(pixels: NDArray[np.uint8]) -> Floats:
    """Linear light in [0, 1] of 8-bit sRGB values, same shape."""
    return _LINEAR_OF_CODES[pixels]


def linear32_from_srgb8(pixels: NDArray[np.uint8]) -> NDArray[np.float32]:
    """The same in single precision: half the memory for whole photos."""
    return _LINEAR_OF_CODES.astype(np.float32)[pixels]


def srgb8_from_linear(linear: Floats) -> NDArray[np.uint8]:
    """8-bit sRGB of linear light; values outside [0, 1] are clipped."""
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

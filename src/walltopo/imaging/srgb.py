"""sRGB and linear light (IEC 61966-2-1)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = [
    "linear32_from_srgb8",
    "linear_from_srgb",
    "linear_from_srgb8",
    "srgb8_from_linear",
    "srgb_from_linear",
]

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

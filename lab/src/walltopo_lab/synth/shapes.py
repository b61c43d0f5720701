"""Signed-distance primitives on a grid, for modelling holds.

All functions take points P (..., 3) float32 in metres and return (...,) float32, negative inside.
Smooth union and difference after I. Quilez, "Smooth minimum" (polynomial form).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

Field = NDArray[np.float32]


def ellipsoid(p: Field, centre: tuple[float, float, float], radii: tuple[float, ...]) -> Field:
    """Return the approximate distance to an axis-aligned ellipsoid."""
    r = np.asarray(radii, np.float32)
    q = (p - np.asarray(centre, np.float32)) / r
    k0 = np.sqrt((q * q).sum(axis=-1))
    q = q / r
    k1 = np.sqrt((q * q).sum(axis=-1)) + np.float32(1e-9)
    return (k0 * (k0 - 1.0) / k1).astype(np.float32)


def rounded_box(
    p: Field, centre: tuple[float, float, float], half: tuple[float, ...], radius: float
) -> Field:
    """Return the distance to a box of half sizes `half` (roundings included)."""
    q = np.abs(p - np.asarray(centre, np.float32)) - (np.asarray(half, np.float32) - radius)
    outside = np.sqrt((np.maximum(q, 0.0) ** 2).sum(axis=-1))
    return (outside + np.minimum(q.max(axis=-1), 0.0) - radius).astype(np.float32)


def capsule(p: Field, start: tuple[float, ...], end: tuple[float, ...], radius: float) -> Field:
    """Return the distance to a capsule from `start` to `end`."""
    a, b = np.asarray(start, np.float32), np.asarray(end, np.float32)
    pa, ba = p - a, b - a
    t = np.clip((pa @ ba) / np.float32(ba @ ba + 1e-12), 0.0, 1.0)
    return (np.sqrt(((pa - t[..., None] * ba) ** 2).sum(axis=-1)) - radius).astype(np.float32)


def half_space(p: Field, normal: Sequence[float] | NDArray[Any], offset: float) -> Field:
    """Return the half space n.p < offset."""
    n = np.asarray(normal, np.float32)
    return (p @ (n / np.linalg.norm(n)) - np.float32(offset)).astype(np.float32)


def join(a: Field, b: Field, blend: float) -> Field:
    """Return the smooth union over a seam of about `blend` metres."""
    h = np.maximum(blend - np.abs(a - b), 0.0) / blend
    return (np.minimum(a, b) - h * h * (blend * 0.25)).astype(np.float32)


def cap(a: Field, b: Field, blend: float) -> Field:
    """Return the smooth intersection."""
    return -join(-a, -b, blend)


def carve(a: Field, tool: Field, blend: float) -> Field:
    """Return the smooth difference: `a` without `tool`."""
    return -join(-a, tool, blend)


def grid_noise(
    shape: tuple[int, ...], cells: int, rng: np.random.Generator, stretch: tuple[int, ...] = ()
) -> Field:
    """Return smooth noise of unit spread on a grid of `shape`, about `cells` bumps across."""
    from scipy.ndimage import zoom

    coarse = [
        max(2, min(n, cells // (stretch[k] if stretch else 1) + 2)) for k, n in enumerate(shape)
    ]
    field = rng.standard_normal(coarse).astype(np.float32)
    factors = [n / c for n, c in zip(shape, coarse, strict=True)]
    fine = zoom(field, factors, order=3, mode="nearest", grid_mode=True)
    return fine[tuple(slice(0, n) for n in shape)].astype(np.float32)

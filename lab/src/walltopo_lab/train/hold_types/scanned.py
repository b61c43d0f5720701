"""Simulated scan artefacts of a hold: its relief after reconstruction and lifting."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.describe.classify.types import Relief, frame_relief, render_heights
from walltopo_lab.synth.bodies import Body
from walltopo_lab.train.hold_types.forms import Grid, hold_heights

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]
GRID = 96  # pixels per side of the grid on which holds are degraded
STEPS = 24  # steps along a shadow


def frontal_heights(body: Body, rng: np.random.Generator, turn_deg: float) -> tuple[Floats, float]:
    """Return the (GRID, GRID) frontal heights of a body, metres, 0 outside, and the pixel size."""
    points = body.vertices * np.exp(rng.normal(0, (0.14, 0.14, 0.18)))
    points = points * np.exp(rng.normal(0, 0.1))
    turn = np.radians(rng.normal(0, turn_deg))
    c, s = np.cos(turn), np.sin(turn)
    points = points @ np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]]).T
    pixel = 2.9 * float(np.abs(points[:, :2]).max()) / GRID
    heights, there = render_heights(points * [1, -1, -1], body.faces, pixel * GRID, GRID)
    return np.where(there, np.maximum(heights, 0), 0.0), pixel


def _raise_unseen(heights: Floats, pixel: float, rng: np.random.Generator) -> Floats:
    """Return heights with unseen surfaces partly raised towards the highest invisible height."""
    hull = np.full_like(heights, np.inf)
    below = np.radians(rng.uniform(5, 55))
    for _ in range(int(rng.integers(1, 5))):
        # Direction towards the camera, in pixels: mostly down and to a side.
        aside = np.radians(rng.normal(0, 40))
        steep = np.tan(np.clip(below + rng.normal(0, 0.2), 0.02, 1.2))
        direction = np.array([np.sin(aside), np.cos(aside)])
        reach = min(float(heights.max()) * steep, 0.5 * GRID * pixel)
        step = max(reach / STEPS, 0.5 * pixel)
        shade = heights.copy()
        for k in range(1, int(reach / step) + 1):
            dx, dy = direction * k * step / pixel
            moved = cv2.warpAffine(
                heights,
                np.array([[1, 0, -dx], [0, 1, -dy]]),
                heights.shape[::-1],
                flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            )
            shade = np.maximum(shade, moved - k * step / steep)
        hull = np.minimum(hull, shade)
    share = rng.uniform(0, 1)
    return np.asarray(heights + share * (hull - heights))


def _smooth_noise(shape: tuple[int, int], scale: float, rng: np.random.Generator) -> Floats:
    """Return smooth noise with unit standard deviation; `scale` in pixels."""
    noise = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), max(scale, 0.3))
    return np.asarray(noise / max(float(noise.std()), 1e-9))


def _fill_pits(heights: Floats, width: float, share: float) -> Floats:
    """Return the heights with pits narrower than `width` pixels filled by `share`."""
    side = max(1, round(width))
    kernel = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
    closed = cv2.morphologyEx(heights, cv2.MORPH_CLOSE, kernel)
    return np.asarray(heights + share * (closed - heights))


def _shift_cells(field: Floats, cell: float, amount: float, rng: np.random.Generator) -> Floats:
    """Return a field resampled with offsets per cell, like a border cut by triangles; pixels."""
    height, width = field.shape
    count = max(2, round(height / max(cell, 1)))
    jump = rng.uniform(-amount, amount, (2, count, count)).astype(np.float32)
    right, down = (
        cv2.resize(one, (width, height), interpolation=cv2.INTER_NEAREST) for one in jump
    )
    y, x = np.mgrid[:height, :width].astype(np.float32)
    return np.asarray(
        cv2.remap(field, x + right, y + down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    )


def _ragged_mask(there: Mask, pixel: float, rng: np.random.Generator) -> Mask:
    """Return a lifted instance's mask: rim lost or wall included, ragged and shifted."""
    inside = cv2.distanceTransform(there.astype(np.uint8), cv2.DIST_L2, 5)
    outside = cv2.distanceTransform((~there).astype(np.uint8), cv2.DIST_L2, 5)
    signed = (inside - outside) * pixel
    size = float(np.sqrt(there.sum())) * pixel
    spread = min(0.005, 0.11 * size)
    signed = signed + rng.normal(0.2, 1) * spread
    signed = signed + rng.uniform(0, 0.8) * spread * _smooth_noise(there.shape, 0.01 / pixel, rng)
    cell = rng.uniform(0.004, 0.011) / pixel
    signed = _shift_cells(signed, cell, rng.uniform(0, 0.8) * cell, rng)
    if rng.random() < 0.3:  # a part is missing
        angle = rng.uniform(0, 2 * np.pi)
        rows, columns = np.nonzero(there)
        along = np.cos(angle) * columns + np.sin(angle) * rows
        limit = np.percentile(along, rng.uniform(60, 98))
        y, x = np.mgrid[: there.shape[0], : there.shape[1]]
        signed = np.where(np.cos(angle) * x + np.sin(angle) * y > limit, -1, signed)
    return np.asarray(signed > 0)


def scanned_relief(heights: Floats, pixel: float, rng: np.random.Generator) -> Relief | None:
    """Return the relief of a hold with scan artefacts, or None without a visible hold.

    Parameters
    ----------
    heights : (n, n) over the wall, metres, 0 outside the hold; pixel : size of a pixel, metres.
    """
    there = heights > 1e-3
    if not there.any():
        return None
    mask = _ragged_mask(there, pixel, rng)
    y, x = np.mgrid[: heights.shape[0], : heights.shape[1]] * pixel
    lean = np.tan(np.radians(rng.normal(0, rng.choice([1.0, 6.0], p=[0.8, 0.2]), 2)))
    surface: Floats = _raise_unseen(heights, pixel, rng) if rng.random() < 0.85 else heights
    if rng.random() < 0.85:  # effect of stereo windows: narrow pits fill up, edges are rounded
        surface = _fill_pits(surface, rng.uniform(0.005, 0.04) / pixel, rng.uniform(0.2, 1))
        width = rng.uniform(0.002, 0.011) / pixel
        surface = np.asarray(cv2.GaussianBlur(surface, (0, 0), width), dtype=np.float64)
    surface = surface + rng.uniform(0.0003, 0.0016) * _smooth_noise(
        heights.shape, rng.uniform(0.003, 0.012) / pixel, rng
    )
    surface = surface + lean[0] * (x - x.mean()) + lean[1] * (y - y.mean())
    surface = surface + rng.normal(0, 0.0015)
    return frame_relief(surface, mask, pixel)


def _wall_patch(grid: Grid, rng: np.random.Generator) -> Floats:
    """Return a patch of wall that was detected as a hold."""
    blob = _smooth_noise(grid.x.shape, rng.uniform(4, 14), rng)
    near = np.hypot(grid.x, grid.y) < rng.uniform(0.25, 0.45) * GRID * grid.pixel
    return np.where((blob > rng.uniform(-0.5, 0.3)) & near, 0.0012 + rng.uniform(0, 0.004), 0.0)


def _two_holds(grid: Grid, rng: np.random.Generator) -> Floats:
    """Return two holds, or parts of them, that were detected as one."""
    heights = np.zeros_like(grid.x)
    names = ("jug", "crimp", "sloper", "pinch", "pocket", "foothold")
    for side in (-1, 1):
        one = hold_heights(str(rng.choice(names)), grid, rng)
        extent = np.sqrt((one > 0).sum())
        angle = rng.uniform(0, np.pi)
        shift = side * 0.5 * extent * np.array([np.cos(angle), np.sin(angle)])
        matrix = np.array([[1, 0, shift[0]], [0, 1, shift[1]]])
        heights = np.maximum(heights, cv2.warpAffine(one, matrix, one.shape[::-1]))
    return heights


def _half_hold(grid: Grid, rng: np.random.Generator) -> Floats:
    """Return half of a large hold."""
    heights = hold_heights(str(rng.choice(["jug", "sloper", "pinch"])), grid, rng)
    angle = rng.uniform(0, 2 * np.pi)
    along = np.cos(angle) * grid.x + np.sin(angle) * grid.y
    return np.where(along < np.percentile(along[heights > 0], rng.uniform(30, 60)), heights, 0)


def _plywood_pyramid(grid: Grid, rng: np.random.Generator) -> Floats:
    """Return a plywood pyramid."""
    corners = int(rng.integers(3, 6))
    turns = rng.uniform(0, 2 * np.pi) + 2 * np.pi * np.arange(corners) / corners
    size = rng.uniform(0.15, 0.4)
    planes = [1 - (np.cos(t) * grid.x + np.sin(t) * grid.y) / size for t in turns]
    return np.asarray(np.clip(np.min(planes, axis=0), 0, 1) * size * rng.uniform(0.35, 0.75))


def nothing_known(rng: np.random.Generator) -> tuple[Floats, float]:
    """Return heights and pixel size of an object that belongs to no single hold type."""
    make = (_wall_patch, _two_holds, _two_holds, _half_hold, _plywood_pyramid)[int(rng.integers(5))]
    pixel = (
        1.1 if make is _plywood_pyramid else float(np.exp(rng.uniform(np.log(0.08), np.log(0.6))))
    ) / GRID
    return make(Grid(GRID, pixel), rng), pixel


def grammar_heights(kind: str, rng: np.random.Generator) -> tuple[Floats, float]:
    """Return heights and pixel size of a grammar's hold; the grid is fitted to its size."""
    seed = int(rng.integers(1 << 62))
    coarse = Grid(GRID, 0.8 / GRID)
    there = hold_heights(kind, coarse, np.random.default_rng(seed)) > 0
    reach = max(float(np.abs(axis[there]).max(initial=0.03)) for axis in (coarse.x, coarse.y))
    pixel = 2.6 * reach / GRID
    return hold_heights(kind, Grid(GRID, pixel), np.random.default_rng(seed)), pixel

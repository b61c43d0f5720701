"""Pseudo-masks from boxes, by colour segmentation inside each labelled box.

GrabCut (Rother, Kolmogorov, Blake: "GrabCut", SIGGRAPH 2004; OpenCV's) runs inside each box with
the ring around it as background. Colour does not separate a hold from a wall of the same paint. A
result is therefore used only if it looks like a tightly boxed object. Otherwise the box gets an
ellipse as its certain core, and its remainder is undecided.
"""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

HULL_POINTS = 16
_WORK_SIZE = 48  # px of the longer box side for GrabCut; more costs time without gain
_MARGIN = 0.35  # ring around the box, as a share of its longer side


def ellipse(box: NDArray[np.generic], share: float = 1.0) -> NDArray[np.bool_]:
    """Return the ellipse inscribed in an (h, w) array, shrunk to `share` of its diameters."""
    height, width = box.shape
    y = (np.arange(height) + 0.5) / height * 2 - 1
    x = (np.arange(width) + 0.5) / width * 2 - 1
    return (y[:, None] ** 2 + x[None, :] ** 2) <= share**2


def mask_is_plausible(mask: NDArray[np.bool_]) -> bool:
    """Return whether a mask fills its (h, w) box like a tightly boxed object."""
    fill = float(mask.mean())
    if not 0.3 <= fill <= 0.97:
        return False
    rows, cols = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    tall, wide = np.ptp(rows) + 1, np.ptp(cols) + 1
    return bool(tall >= 0.8 * mask.shape[0] and wide >= 0.8 * mask.shape[1])


def _largest_part(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    count, parts, stats, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8), connectivity=4)
    if count <= 2:
        return mask
    return np.asarray(parts == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax()))


def _run_grabcut(image: cv2.typing.MatLike, state: NDArray[np.uint8]) -> bool:
    """Refine the state of each pixel; return whether both sides have a colour model."""
    try:
        models = np.zeros((1, 65)), np.zeros((1, 65))
        cv2.grabCut(image, state, (0, 0, 0, 0), *models, 3, cv2.GC_INIT_WITH_MASK)
    except cv2.error:  # too few pixels of one side
        return False
    return True


def box_mask(
    image: NDArray[np.uint8],
    box: NDArray[np.float64],
    others: NDArray[np.bool_],
    rng: np.random.Generator,
) -> NDArray[np.bool_] | None:
    """Return the mask of the object in a box, or None if colour does not separate it.

    Parameters
    ----------
    image : (H, W, 3) uint8, BGR.
    box : (4,) x0, y0, x1, y1 in pixels.
    others : (H, W) bool, pixels inside any labelled box; excluded from the background.

    Returns
    -------
    (h, w) bool for rows round(y0):round(y1) and columns round(x0):round(x1).
    """
    height, width = image.shape[:2]
    x0, y0, x1, y1 = (round(float(v)) for v in box)
    w, h = x1 - x0, y1 - y0
    if w < 4 or h < 4:
        return None
    ring = max(3, round(_MARGIN * max(w, h)))
    left, top = max(0, x0 - ring), max(0, y0 - ring)
    right, bottom = min(width, x1 + ring), min(height, y1 + ring)
    scale = min(1.0, _WORK_SIZE / max(w, h))
    size = (max(8, round((right - left) * scale)), max(8, round((bottom - top) * scale)))
    crop = cv2.resize(image[top:bottom, left:right], size, interpolation=cv2.INTER_AREA)
    busy = (
        cv2.resize(
            others[top:bottom, left:right].astype(np.uint8), size, interpolation=cv2.INTER_NEAREST
        )
        > 0
    )
    sx, sy = size[0] / (right - left), size[1] / (bottom - top)
    u0, u1 = round((x0 - left) * sx), round((x1 - left) * sx)
    v0, v1 = round((y0 - top) * sy), round((y1 - top) * sy)
    state = np.full(size[::-1], cv2.GC_BGD, np.uint8)
    inside = state[v0:v1, u0:u1]
    inside[:] = np.where(ellipse(inside), cv2.GC_PR_FGD, cv2.GC_PR_BGD)
    inside[ellipse(inside, 0.35)] = cv2.GC_FGD
    busy[v0:v1, u0:u1] = True
    free = crop[~busy]
    if len(free) < 12:
        return None
    # Paint over neighbouring objects, which would add their colours to the background model.
    outside = busy.copy()
    outside[v0:v1, u0:u1] = False
    crop[outside] = free[rng.integers(len(free), size=int(outside.sum()))]
    if not _run_grabcut(crop, state):
        return None
    found = np.isin(state[v0:v1, u0:u1], (cv2.GC_FGD, cv2.GC_PR_FGD))
    if not found.any():
        return None
    found = _largest_part(found)
    if not mask_is_plausible(found):
        return None
    full = cv2.resize(found.astype(np.float32), (w, h), interpolation=cv2.INTER_LINEAR) > 0.5
    return np.asarray(full)


def hull_of(mask: NDArray[np.bool_], box: NDArray[np.float64]) -> NDArray[np.float32]:
    """Return (HULL_POINTS, 2) points of the mask's convex hull, stretched to fill the box.

    The labelled box is exact, unlike the mask. Under rotation the extent of these points
    is the best estimate of the object's new box.
    """
    rows, cols = np.nonzero(mask)
    points = np.stack([cols, rows], axis=1).astype(np.float32)
    points = np.concatenate([points + d for d in ((0, 0), (1, 0), (0, 1), (1, 1))])
    hull = cv2.convexHull(points.astype(np.float32))[:, 0, :].astype(np.float64)
    pick = np.linspace(0, len(hull), HULL_POINTS, endpoint=False).astype(int)
    extremes = [hull[:, k].argmin() for k in (0, 1)] + [hull[:, k].argmax() for k in (0, 1)]
    hull = hull[np.concatenate([pick[: HULL_POINTS - 4], extremes])]
    low, high = hull.min(axis=0), hull.max(axis=0)
    hull = (hull - low) / np.maximum(high - low, 1e-6)
    return (hull * (box[2:] - box[:2]) + box[:2]).astype(np.float32)


def paint_instances(
    image: NDArray[np.uint8], boxes: NDArray[np.float64], seed: int = 0
) -> tuple[NDArray[np.int16], NDArray[np.float32], int]:
    """Paint one photo's boxes as pseudo-masks, large ones first so that small ones are on top.

    Returns
    -------
    ids : (H, W) int16; 0 background, k + 1 the k-th box's object, -1 undecided.
    hulls : (n, HULL_POINTS, 2) float32, see `hull_of`.
    trusted : number of masks with a plausible colour segmentation.
    """
    height, width = image.shape[:2]
    rng = np.random.default_rng(seed)
    ids = np.zeros((height, width), np.int16)
    hulls = np.zeros((len(boxes), HULL_POINTS, 2), np.float32)
    clipped = np.clip(boxes, 0, [width, height, width, height])
    busy = np.zeros((height, width), np.bool_)
    corners = np.round(clipped).astype(int)
    for x0, y0, x1, y1 in corners:
        busy[y0:y1, x0:x1] = True
    trusted = 0
    areas = np.prod(clipped[:, 2:] - clipped[:, :2], axis=1)
    for k in np.argsort(-areas, kind="stable"):
        x0, y0, x1, y1 = (int(v) for v in corners[k])
        x1, y1 = max(x1, x0 + 1), max(y1, y0 + 1)
        region = ids[y0:y1, x0:x1]
        if region.size == 0:
            continue
        mask = box_mask(image, clipped[k], busy, rng)
        if mask is None:
            round_shape = ellipse(region)
            region[round_shape] = -1
            region[ellipse(region, 0.7)] = k + 1
            mask = round_shape
        else:
            region[mask] = k + 1
            trusted += 1
        hulls[k] = hull_of(mask, clipped[k])
    return ids, hulls, trusted

"""What stands out of the wall's panels: pieces of surface that may be holds.

A piece hangs together, is higher than its panel is rough, and lies on no instance that the masks
are sure of. What is left of a sure instance's rim, because masks are drawn too small, is no piece
of its own.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.meshes.neighbours import patches
from walltopo.meshes.panels import Heights, Panel

__all__ = ["find_bumps", "stands_out"]

Ints = NDArray[np.int64]

LOW, HIGH = 0.005, 0.008  # metres: a bump begins at the first and reaches the second
ROUGH, ROUGHER = 3.0, 5.0  # the same in standard deviations of the panel's own noise
TOP = 90.0  # percentile of the heights that counts as the top
LEAST_AREA, MOST_AREA = 0.0006, 0.8  # square metres
LONGEST = 1.6  # metres
RIM = 0.015  # metres: so near to a sure instance a triangle is of its rim
CORE = 0.4  # share of a bump that must not be


def stands_out(
    heights: Heights, panels: Sequence[Panel], unit: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """(F,) which triangles are higher than their panel is rough, and (F,) what a top must reach."""
    noise = np.array([panel.noise for panel in panels] + [np.inf])[heights.panel]
    begins = np.maximum(LOW * unit, ROUGH * noise)
    with np.errstate(invalid="ignore"):
        return (heights.panel >= 0) & (heights.height > begins), np.maximum(
            HIGH * unit, ROUGHER * noise
        )


def find_bumps(
    mesh: Mesh,
    neighbours: NDArray[np.int32],
    heights: Heights,
    panels: Sequence[Panel],
    sure: NDArray[np.bool_],
    unit: float,
) -> list[Ints]:
    """Triangles of each bump, the largest first.

    Parameters
    ----------
    mesh : the measured part of the scan's; neighbours : (F, 3), see `face_neighbours`.
    heights, panels : of `heights_over` and `find_panels`.
    sure : (F,) triangles of instances that the masks are sure of.
    unit : mesh units a metre.
    """
    out, top = stands_out(heights, panels, unit)
    free = out & ~sure
    part, first = patches(neighbours, free.astype(np.int32))
    count = len(first)
    area = np.bincount(part, mesh.areas * free, count)
    wanted = (area > LEAST_AREA * unit**2) & (area < MOST_AREA * unit**2)
    rows = np.flatnonzero(free & wanted[part])
    order = rows[np.argsort(part[rows], kind="stable")]
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    beside = cKDTree(mesh.centroids[sure]) if sure.any() else None
    found = []
    for piece in np.split(order, starts[1:]) if len(order) else []:
        places = mesh.centroids[piece]
        if np.percentile(heights.height[piece], TOP) < np.median(top[piece]):
            continue
        if np.ptp(places, axis=0).max() > LONGEST * unit:
            continue
        if beside is not None:
            away, _ = beside.query(places, distance_upper_bound=RIM * unit)
            core = mesh.areas[piece][np.isinf(away)].sum()
            if core < max(CORE * mesh.areas[piece].sum(), LEAST_AREA * unit**2):
                continue
        found.append(piece)
    return sorted(found, key=lambda piece: -float(mesh.areas[piece].sum()))

"""What stands out of the wall's panels: pieces of surface that may be holds.

A piece hangs together, is higher than its panel is rough, and lies on no instance that the masks
are sure of. What is left beside a sure instance, because masks are drawn small, and because a mesh
rounds the foot of a hold, is the rest of that instance and no hold of its own. It is not given to
the instance either: a mask's outline is better than that of a mesh.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from walltopo.core import Mesh
from walltopo.geometry.neighbours import patches
from walltopo.geometry.panels import Heights, Panel

Ints = NDArray[np.int64]
Labels = NDArray[np.int32]

LOW, HIGH = 0.005, 0.008  # metres: a bump begins at the first and reaches the second
ROUGH, ROUGHER = 3.0, 5.0  # the same in standard deviations of the panel's own noise
TOP = 90.0  # percentile of the heights that counts as the top
LEAST_AREA, MOST_AREA = 0.0006, 0.8  # square metres
LONGEST = 1.6  # metres
BESIDE = 0.02  # metres: a piece that comes so near to a sure instance hangs together with it
REST = 1.5  # a piece smaller than this share of the instances beside it is the rest of them


def stands_out(
    heights: Heights, panels: Sequence[Panel], unit: float
) -> tuple[NDArray[np.bool_], NDArray[np.float64]]:
    """(F,) which triangles are higher than their panel is rough, and (F,) what a top must reach."""
    noise = np.array([panel.noise for panel in panels] + [np.inf])[heights.panel]
    begins = np.maximum(LOW * unit, ROUGH * noise)
    with np.errstate(invalid="ignore"):
        out = (heights.panel >= 0) & (heights.height > begins)
    return out, np.maximum(HIGH * unit, ROUGHER * noise)


def find_bumps(
    mesh: Mesh,
    neighbours: NDArray[np.int32],
    heights: Heights,
    panels: Sequence[Panel],
    sure: Labels,
    unit: float,
) -> list[Ints]:
    """Triangles of each piece that stands out and may be a hold, the largest first.

    Parameters
    ----------
    mesh : the measured part of the scan's; neighbours : (F, 3), see `face_neighbours`.
    heights, panels : of `heights_over` and `find_panels`.
    sure : (F,) int32, the instance that the masks are sure of, 0 = none.
    unit : mesh units a metre.
    """
    out, top = stands_out(heights, panels, unit)
    held = np.flatnonzero(sure)
    size = np.bincount(sure, mesh.areas)
    beside = cKDTree(mesh.centroids[held]) if len(held) else None
    found: list[Ints] = []
    for piece in _parts(mesh, neighbours, out & (sure == 0), LEAST_AREA * unit**2):
        places = mesh.centroids[piece]
        if np.ptp(places, axis=0).max() > LONGEST * unit:
            continue
        if np.percentile(heights.height[piece], TOP) < np.median(top[piece]):
            continue
        if beside is not None:
            away, nearest = beside.query(places, distance_upper_bound=BESIDE * unit)
            hosts = np.unique(sure[held[nearest[np.isfinite(away)]]])
            if mesh.areas[piece].sum() < REST * size[hosts].sum():
                continue
        found.append(piece)
    return sorted(found, key=lambda piece: -float(mesh.areas[piece].sum()))


def _parts(
    mesh: Mesh, neighbours: NDArray[np.int32], chosen: NDArray[np.bool_], least: float
) -> list[Ints]:
    """Triangles that hang together, as far as they are large enough and not too large."""
    part, first = patches(neighbours, chosen.astype(np.int32))
    area = np.bincount(part, mesh.areas * chosen, len(first))
    wanted = (area > least) & (area < least / LEAST_AREA * MOST_AREA)
    rows = np.flatnonzero(chosen & wanted[part])
    order = rows[np.argsort(part[rows], kind="stable")]
    starts = np.flatnonzero(np.diff(part[order], prepend=-1))
    return np.split(order, starts[1:]) if len(order) else []

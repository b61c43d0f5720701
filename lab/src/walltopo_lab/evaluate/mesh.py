"""Accuracy and completeness of a reconstructed mesh against the true one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo_lab.evaluate.carry import Carried
from walltopo_lab.evaluate.surface import Surface
from walltopo_lab.evaluate.truth import Truth

Floats = NDArray[np.float64]

ACCURACY_M = 0.008
COMPLETENESS_M = 0.010
# Faces farther than this from the truth count as far, without a measured distance.
REACH_M = 0.2


def on_floor(mesh: Mesh) -> NDArray[np.bool_]:
    """Return (F,) faces that lie flat within 3 cm of z = 0: mats and floor are not the wall."""
    return (np.abs(mesh.centroids[:, 2]) < 0.03) & (np.abs(mesh.normals[:, 2]) > 0.9)


def _quantile(values: Floats, weights: Floats, share: float) -> float:
    order = np.argsort(values)
    cumulative = np.cumsum(weights[order])
    index = np.searchsorted(cumulative, share * cumulative[-1])
    return float(values[order][min(index, len(values) - 1)])


def mesh_metrics(mesh: Mesh, truth: Truth, carried: Carried) -> dict[str, Any]:
    """Return accuracy (scan to truth) and completeness (truth seen by >= 3 photos to scan), by
    area.

    Both sides exclude floor and mats. The distance of a face is that of its centroid.

    Parameters
    ----------
    mesh : the scan's, in the truth's frame, metres.
    carried : the truth carried onto the scan's mesh, with a reach of `REACH_M`.

    Returns
    -------
    accuracy_8mm, completeness_10mm : shares of area.
    accuracy_median_mm, accuracy_90_mm : distances that 50 % and 90 % of the area keep (None beyond
        reach).
    holds_over_5cm, holds_present : true instances with a seen area over 5 cm x 5 cm, and those with
        at least a quarter of their area within 10 mm of the scan.
    """
    floor = on_floor(truth.mesh)
    nearest_is_floor = (carried.true_face >= 0) & floor[carried.true_face]
    wall = ~nearest_is_floor & ~carried.ignored & ~on_floor(mesh)
    off, areas = carried.distance[wall], mesh.areas[wall]
    target = (truth.face_views >= 3) & ~floor
    surface = Surface(mesh.vertices, mesh.faces)
    _, gap = surface.nearest(truth.mesh.centroids[target], COMPLETENESS_M)
    reached = np.isfinite(gap)
    true = truth.mesh.areas[target]
    ids = truth.face_instance[target]
    size = np.bincount(ids, true)
    share = np.bincount(ids, true * reached) / np.where(size > 0, size, 1.0)
    large = np.flatnonzero(size > 0.05**2)
    large = large[large != 0]

    def millimetres(share_of_area: float) -> float | None:
        value = _quantile(off, areas, share_of_area) if len(off) else np.inf
        return 1000 * value if np.isfinite(value) else None

    return {
        "faces": len(mesh.faces),
        "accuracy_8mm": float(areas[off <= ACCURACY_M].sum() / max(areas.sum(), 1e-12)),
        "accuracy_median_mm": millimetres(0.5),
        "accuracy_90_mm": millimetres(0.9),
        "completeness_10mm": float(true[reached].sum() / max(true.sum(), 1e-12)),
        "holds_over_5cm": len(large),
        "holds_present": int((share[large] >= 0.25).sum()),
    }

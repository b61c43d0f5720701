"""Alignment of a scan's frame to the truth's, and the remaining errors: poses, scale, up, floor."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.geometry.similarity import Similarity, fit_similarity
from walltopo.scans.holds import Hold

Floats = NDArray[np.float64]

_SAME_HOLD_M: Final = 0.12  # between a hold of the scan and the true one


def _common(scan: Mapping[str, View], truth: Mapping[str, View], least: int) -> list[str]:
    names = sorted(set(scan) & set(truth))
    if len(names) < least:
        raise InputError(
            f"the scan and the truth have {len(names)} photos in common; {least} are needed",
            f"The scan has {sorted(scan)[:3]}, the truth {sorted(truth)[:3]}.",
        )
    return names


def fit_heading(scan: Floats, truth: Floats) -> Similarity:
    """Fit a rotation about z and a shift along the floor: the free parameters of a metric, upright
    scan.

    The fit is least squares over (n, 3) points, n >= 2, and leaves the height unchanged.
    """
    a, b = scan[:, :2] - scan[:, :2].mean(axis=0), truth[:, :2] - truth[:, :2].mean(axis=0)
    angle = np.arctan2((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum(), (a * b).sum())
    c, s = np.cos(angle), np.sin(angle)
    rotation = np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    shift = truth.mean(axis=0) - rotation @ scan.mean(axis=0)
    return Similarity(1.0, rotation, np.array([shift[0], shift[1], 0.0]))


def _centres(views: Mapping[str, View], names: list[str]) -> Floats:
    return np.array([views[name].centre for name in names])


def align_views(
    scan: Mapping[str, View], truth: Mapping[str, View], similarity: bool
) -> Similarity:
    """Return the transform from the scan's frame to the truth's, fitted to their common photos."""
    names = _common(scan, truth, 3)
    fit = fit_similarity if similarity else fit_heading
    return fit(_centres(scan, names), _centres(truth, names))


def same_holds(
    holds: Sequence[Hold], places: Floats, true: Mapping[int, Sequence[float]]
) -> dict[int, int]:
    """Return the true id of each hold of a scan by its id, 0 for those that are not true.

    Parameters
    ----------
    places : (N, 3) m, of the holds in the truth's frame. true : places by id; not empty.
    """
    ids, exact = list(true), np.array(list(true.values()))
    away = np.linalg.norm(places[:, None] - exact[None], axis=2)
    nearest = away.argmin(axis=1)
    return {
        hold.id: ids[k] if away[row, k] < _SAME_HOLD_M else 0
        for row, (hold, k) in enumerate(zip(holds, nearest.tolist(), strict=True))
    }


def pose_metrics(
    scan: Mapping[str, View], truth: Mapping[str, View], similarity: bool
) -> dict[str, Any]:
    """Return the camera errors that remain after the fit.

    Returns
    -------
    photos, registered : number of photos in the truth, and of those that the scan contains.
    centre_median_mm, centre_max_mm : camera centres.
    rotation_median_deg, rotation_max_deg : camera rotations.
    scale_error_percent, up_error_deg, floor_error_mm : of the best similarity against the scan's
        own frame (of a metric scan), so that the fit cannot hide them. Floor: median height
        difference of the camera centres.
    """
    names = _common(scan, truth, 3)
    a, b = _centres(scan, names), _centres(truth, names)
    transform = (fit_similarity if similarity else fit_heading)(a, b)
    best = fit_similarity(a, b)
    off = 1000 * np.linalg.norm(transform.apply(a) - b, axis=1)
    turns = []
    for name in names:
        mine = scan[name].cam_from_world[:, :3] @ transform.rotation.T
        difference = mine @ truth[name].cam_from_world[:, :3].T
        # Use the chord |R - 1|: the trace loses half the digits near zero.
        half = np.linalg.norm(difference - np.eye(3)) / np.sqrt(8)
        turns.append(np.degrees(2 * np.arcsin(min(half, 1.0))))
    return {
        "photos": len(truth),
        "registered": len(names),
        "centre_median_mm": float(np.median(off)),
        "centre_max_mm": float(off.max()),
        "rotation_median_deg": float(np.median(turns)),
        "rotation_max_deg": float(np.max(turns)),
        "scale_error_percent": 100 * abs(1 / best.scale - 1),
        "up_error_deg": float(np.degrees(np.arccos(np.clip(best.rotation[2, 2], -1, 1)))),
        "floor_error_mm": float(1000 * abs(np.median(a[:, 2] - b[:, 2]))),
    }

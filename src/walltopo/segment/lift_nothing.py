"""Explain a lift that found no instance."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walltopo.core import InputError, Mesh, View
from walltopo.segment.lift.distance import mean_object_distance, resolve_lengths
from walltopo.segment.lift.settings import LiftParams
from walltopo.segment.lift_frames import explain_frames


def explain_nothing(mesh: Mesh, views: Sequence[View], params: LiftParams) -> InputError:
    """Return the error that explains why no instance was found.

    The causes are empty masks, rays that miss the mesh or meet it from behind (units or frames
    differ), and objects beyond `visibility_distance`.
    """
    if not any(mask.area for view in views for mask in view.masks):
        count = sum(len(view.masks) for view in views)
        return InputError(
            f"0 instances: all {count} masks are empty" if count else "0 instances: no masks",
            "Annotations without pixels (`segmentation: []`, boxes alone) cannot be lifted.",
        )
    try:
        mean = mean_object_distance(mesh, views, params.seed)
    except InputError:
        frames = explain_frames(mesh, views, params.seed)
        return InputError(
            f"0 instances: no ray through a mask meets the mesh; {_compare_extents(mesh, views)}",
            frames and f"Of the usual units and axes one fits: {frames}.",
        )
    frames = explain_frames(mesh, views, params.seed)
    limit = resolve_lengths(params, mesh, views).visibility_distance
    if mean > limit:
        return InputError(
            f"0 instances: the objects are {mean:.4g} units from the cameras on average, beyond "
            f"the visibility_distance of {limit:.4g}",
            f"If the unit of the mesh is not the metre, use --normalised. {frames}".strip(),
        )
    cause = frames or "the masks of different photos agree on no object"
    return InputError(f"0 instances: {cause}; {_compare_extents(mesh, views)}")


def _compare_extents(mesh: Mesh, views: Sequence[View]) -> str:
    """Return the extents of mesh and cameras in words, with their ratio."""
    sizes = [
        float(np.linalg.norm(np.ptp(points, axis=0)))
        for points in (mesh.vertices, np.array([view.centre for view in views]))
    ]
    if sizes[1] == 0:
        return f"the mesh has an extent of {sizes[0]:.4g}, and all cameras are in one place"
    ratio = sizes[0] / sizes[1]
    unit = "if their units differ (mm and m: a ratio of 1000), scale one of them"
    return (
        f"the mesh has an extent of {sizes[0]:.4g}, the cameras of {sizes[1]:.4g}, a ratio of "
        f"{ratio:.3g}: {unit}; else check that both are in the same coordinate frame"
    )

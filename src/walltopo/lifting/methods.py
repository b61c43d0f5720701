"""The choice of method, behind `walltopo.lifting.lift`."""

from __future__ import annotations

from collections.abc import Sequence

from walltopo.core import InputError, Instances, Mesh, Progress, Silent, View
from walltopo.lifting.contract import LiftParams
from walltopo.lifting.distance import resolve_lengths
from walltopo.lifting.fast import lift_literal, nothing
from walltopo.lifting.guesses import with_guesses
from walltopo.lifting.robust import lift_robust

__all__ = ["run_method"]


def run_method(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress | None
) -> Instances:
    """Lift by the method that `params` names; see `walltopo.lifting.lift`."""
    progress = progress or Silent()
    if len(mesh.faces) == 0:
        raise InputError("the mesh has no triangles", "Is it a point cloud? Mesh it first.")
    if not any(mask.area for view in views for mask in view.masks):
        return nothing(len(mesh.faces))
    if mesh.guessed is not None:
        found = run_method(mesh.without_guesses(), views, params, progress)
        return with_guesses(found, mesh)
    params = resolve_lengths(params, mesh, views)
    if params.method == "literal":
        return lift_literal(mesh, views, params, progress)
    return lift_robust(mesh, views, params, progress)

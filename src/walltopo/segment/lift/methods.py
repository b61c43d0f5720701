"""Choose the method of a lift, and extend its labels onto guessed triangles."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances, Mesh, Progress, Silent, View
from walltopo.geometry.topology import face_components, face_neighbours
from walltopo.segment.lift.distance import resolve_lengths
from walltopo.segment.lift.fast import lift_literal, no_instances
from walltopo.segment.lift.robust import lift_robust
from walltopo.segment.lift.settings import LiftParams


def run_method(
    mesh: Mesh, views: Sequence[View], params: LiftParams, progress: Progress | None
) -> Instances:
    """Return the instances by the method that `params` names; see `walltopo.segment.lift.lift`."""
    progress = progress or Silent()
    if len(mesh.faces) == 0:
        raise InputError("the mesh has no triangles", "Is it a point cloud? Mesh it first.")
    if not any(mask.area for view in views for mask in view.masks):
        return no_instances(len(mesh.faces))
    if mesh.guessed is not None:
        found = run_method(mesh.without_guesses(), views, params, progress)
        return with_guesses(found, mesh)
    params = resolve_lengths(params, mesh, views)
    if params.method == "literal":
        return lift_literal(mesh, views, params, progress)
    return lift_robust(mesh, views, params, progress)


def with_guesses(found: Instances, mesh: Mesh) -> Instances:
    """Return the labels of the whole mesh from those of its measured triangles.

    A connected component of guessed triangles gets an instance, with score 0, if all measured
    triangles around it belong to that instance. Otherwise it stays unlabelled.
    Parameters
    ----------
    found : the instances of `mesh.without_guesses()`.
    """
    label = np.zeros(len(mesh.faces), dtype=np.int32)
    score = np.zeros(len(mesh.faces), dtype=np.float32)
    label[mesh.measured], score[mesh.measured] = found.face_instance, found.face_score
    guessed = np.flatnonzero(~mesh.measured)
    if len(guessed):
        label[guessed] = _enclosing_labels(label, mesh, guessed)
    return Instances(label, score, found.records)


def _enclosing_labels(
    label: NDArray[np.int32], mesh: Mesh, guessed: NDArray[np.int64]
) -> NDArray[np.int32]:
    """Return the (n,) label around each guessed face's component, 0 if the labels differ."""
    part = face_components(mesh.faces[guessed])
    across = face_neighbours(mesh.faces)[guessed]
    row, side = np.nonzero(across >= 0)
    other = across[row, side]
    beside = mesh.measured[other]
    around, where = label[other[beside]], part[row[beside]]
    count = int(part.max()) + 1
    low = np.full(count, np.iinfo(np.int32).max, dtype=np.int32)
    high = np.zeros(count, dtype=np.int32)
    np.minimum.at(low, where, around)
    np.maximum.at(high, where, around)
    return np.asarray(np.where(low == high, high, 0)[part], dtype=np.int32)

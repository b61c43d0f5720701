"""Transfer of labels between two meshes of the same wall."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo_lab.evaluate.overlap import Labelled, Overlap, overlap_of_faces
from walltopo_lab.evaluate.surface import Surface
from walltopo_lab.evaluate.truth import Truth

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Carried:
    """The truth on the faces of another mesh.

    Parameters
    ----------
    labelled : the true instance of each of the F faces.
    ignored : (F,) faces on surface that no photo saw.
    distance : (F,) float, metres from the face's centroid to the true surface that was seen;
        inf beyond reach.
    true_face : (F,) int, the nearest true face that was seen, -1 beyond reach.
    """

    labelled: Labelled
    ignored: NDArray[np.bool_]
    distance: Floats
    true_face: NDArray[np.int64]


def carry_truth(truth: Truth, mesh: Mesh, within: float, reach: float = 0.0) -> Carried:
    """Label each face of `mesh` by the nearest true surface that a photo saw.

    The backs of holds lie a few millimetres behind their fronts. So unseen surface counts only
    where no seen surface is near, and faces on it are ignored. Faces far from both carry no
    instance and still count: an instance found there is false.

    Parameters
    ----------
    mesh : in the truth's frame, metres.
    within : carrying distance, metres.
    reach : radius of the distance measurement, metres, if larger than `within`.
    """
    count = len(mesh.faces)
    if count == len(truth.mesh.faces) and np.allclose(
        mesh.centroids, truth.mesh.centroids, atol=1e-6
    ):
        own = np.arange(count)
        return Carried(truth.labelled, truth.ignored, np.zeros(count), own)
    face, distance = _nearest(truth, ~truth.ignored, mesh.centroids, max(within, reach))
    far = np.flatnonzero(distance > within)
    unseen, _ = _nearest(truth, truth.ignored, mesh.centroids[far], within)
    ignored = np.zeros(count, dtype=np.bool_)
    ignored[far] = unseen >= 0
    carried = np.where(distance <= within, truth.face_instance[face], 0).astype(np.int32)
    return Carried(Labelled(carried, truth.labelled.labels), ignored, distance, face)


def _nearest(
    truth: Truth, chosen: NDArray[np.bool_], points: Floats, within: float
) -> tuple[NDArray[np.int64], Floats]:
    subset = np.flatnonzero(chosen)
    if len(subset) == 0 or len(points) == 0:
        return np.full(len(points), -1), np.full(len(points), np.inf)
    surface = Surface(truth.mesh.vertices, truth.mesh.faces[subset])
    face, distance = surface.nearest(points, within)
    return np.where(face >= 0, subset[face], -1), distance


def carry_prediction(mesh: Mesh, predicted: Labelled, truth: Truth, within: float) -> Labelled:
    """Return the prediction on the true mesh; faces far from the scan get no instance."""
    result = np.zeros(len(truth.mesh.faces), dtype=np.int32)
    seen = np.flatnonzero(~truth.ignored)
    face, _ = Surface(mesh.vertices, mesh.faces).nearest(truth.mesh.centroids[seen], within)
    result[seen] = np.where(face >= 0, predicted.face_instance[face], 0)
    return Labelled(result, predicted.labels, predicted.scores)


def true_areas(truth: Truth) -> dict[int, float]:
    """Return the seen area of each true instance, square metres."""
    areas = np.bincount(truth.face_instance, truth.mesh.areas * ~truth.ignored)
    return {int(i): float(areas[i]) for i in np.flatnonzero(areas) if i}


def overlap_with_missing(
    predicted: Labelled, carried: Carried, areas: Floats, truth: Truth
) -> Overlap:
    """Return the overlap on the scan's mesh; true instances without a face there count as missed.

    Without them, a scan that omits half of the wall would score perfectly.
    """
    overlap = overlap_of_faces(predicted, carried.labelled, areas, carried.ignored)
    present = set(overlap.truth_ids.tolist())
    missing = {i: area for i, area in true_areas(truth).items() if i not in present}
    if not missing:
        return overlap
    ids = np.array(list(missing), dtype=np.int64)
    labels = np.array([truth.labelled.labels[int(i)] for i in ids], dtype=np.int64)
    return dataclasses.replace(
        overlap,
        shared=np.hstack([overlap.shared, np.zeros((len(overlap.pred_sizes), len(ids)))]),
        truth_sizes=np.concatenate([overlap.truth_sizes, list(missing.values())]),
        truth_labels=np.concatenate([overlap.truth_labels, labels]),
        truth_ids=np.concatenate([overlap.truth_ids, ids]),
    )

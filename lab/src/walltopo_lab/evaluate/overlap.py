"""Shared weight of each predicted and each true instance: the complete input of an AP."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Instances

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Labelled:
    """A mesh whose faces belong to instances: a prediction or the truth.

    Parameters
    ----------
    face_instance : (F,) int, 0 = none, else an instance's id.
    labels : class id of each instance; must contain every id of `face_instance`.
    scores : confidence of each instance, 1.0 if absent. Unused for truth.
    """

    face_instance: NDArray[np.int32]
    labels: Mapping[int, int]
    scores: Mapping[int, float] | None = None

    def __post_init__(self) -> None:
        if self.face_instance.ndim != 1:
            raise InputError(f"face_instance: expected (F,), got {self.face_instance.shape}")
        present = set(np.unique(self.face_instance).tolist()) - {0}
        stray = sorted(present - set(self.labels))
        if stray:
            raise InputError(f"faces carry instance ids without a class: {stray[:5]}")

    @classmethod
    def of(cls, instances: Instances) -> Labelled:
        """Return the prediction of a lift."""
        return cls(
            instances.face_instance,
            {record.id: record.label for record in instances.records},
            {record.id: record.score for record in instances.records},
        )


@dataclass(frozen=True, eq=False)
class Overlap:
    """The shared weight of P predictions and T true instances of one scene.

    Parameters
    ----------
    shared : (P, T) float, weight of the elements in both.
    pred_sizes, truth_sizes : (P,), (T,) float, weight of each instance.
    pred_void : (P,) float, weight of each prediction that lies in void.
    pred_scores : (P,) float, confidences.
    pred_labels, truth_labels : (P,), (T,) int, class ids.
    pred_ids, truth_ids : (P,), (T,) int, the original ids of the instances.
    """

    shared: Floats
    pred_sizes: Floats
    truth_sizes: Floats
    pred_void: Floats
    pred_scores: Floats
    pred_labels: Ints
    truth_labels: Ints
    pred_ids: Ints
    truth_ids: Ints

    def iou(self) -> Floats:
        """Return (P, T) intersection over union; 0 if both are empty."""
        union = self.pred_sizes[:, None] + self.truth_sizes[None, :] - self.shared
        return np.divide(self.shared, union, out=np.zeros_like(self.shared), where=union > 0)

    def select(self, label: int | None) -> Overlap:
        """Return only the instances of one class; with None, all of them as one class."""
        if label is None:
            return self
        p, t = self.pred_labels == label, self.truth_labels == label
        return Overlap(
            self.shared[np.ix_(p, t)],
            self.pred_sizes[p],
            self.truth_sizes[t],
            self.pred_void[p],
            self.pred_scores[p],
            self.pred_labels[p],
            self.truth_labels[t],
            self.pred_ids[p],
            self.truth_ids[t],
        )


def _incidence_matrix(face_instance: NDArray[np.int32], ids: Ints) -> Any:
    """Return a sparse (len(ids), F) 0/1 matrix of the faces of each instance."""
    from scipy import sparse

    faces = np.flatnonzero(face_instance)
    rows = np.searchsorted(ids, face_instance[faces])
    values = np.ones(len(faces), dtype=np.float64)
    return sparse.csr_matrix((values, (rows, faces)), shape=(len(ids), len(face_instance)))


def overlap_of_faces(
    predicted: Labelled,
    truth: Labelled,
    weights: Floats,
    ignored: NDArray[np.bool_] | None = None,
    void: NDArray[np.bool_] | None = None,
) -> Overlap:
    """Return the overlap of two labellings of the same mesh.

    Parameters
    ----------
    weights : (F,) float >= 0, weight of each face: its area, or 1.
    ignored : (F,) bool, faces to exclude (those that no photo saw). Instances wholly within them
        are neither hits nor misses.
    void : (F,) bool, ScanNet's void: counts as part of a prediction, and excuses a false
        prediction that lies mostly in it.

    Raises
    ------
    InputError : the arrays describe different faces; the message states the lengths.
    """
    count = len(predicted.face_instance)
    for name, array in (("truth", truth.face_instance), ("weights", weights)):
        if len(array) != count:
            raise InputError(f"prediction has {count} faces, {name} has {len(array)}")
    keep = np.ones(count, dtype=np.bool_) if ignored is None else ~np.asarray(ignored, np.bool_)
    hidden = np.zeros(count, dtype=np.bool_) if void is None else np.asarray(void, np.bool_)
    for name, flags in (("ignored", keep), ("void", hidden)):
        if len(flags) != count:
            raise InputError(f"prediction has {count} faces, {name} has {len(flags)}")
    keep &= np.asarray(weights) > 0  # an instance without area can be neither found nor missed
    pred_faces = np.where(keep, predicted.face_instance, 0)
    truth_faces = np.where(keep & ~hidden, truth.face_instance, 0)
    pred_ids = np.setdiff1d(np.unique(pred_faces), [0]).astype(np.int64)
    truth_ids = np.setdiff1d(np.unique(truth_faces), [0]).astype(np.int64)
    scores = predicted.scores or {}
    return overlap_of_sets(
        _incidence_matrix(pred_faces, pred_ids),
        _incidence_matrix(truth_faces, truth_ids),
        np.asarray(weights, dtype=np.float64),
        np.array([scores.get(int(i), 1.0) for i in pred_ids], dtype=np.float64),
        np.array([predicted.labels[int(i)] for i in pred_ids], dtype=np.int64),
        np.array([truth.labels[int(i)] for i in truth_ids], dtype=np.int64),
        void=hidden,
        ids=(pred_ids, truth_ids),
    )


def overlap_of_sets(
    predicted: Any,
    truth: Any,
    weights: Floats,
    pred_scores: Floats,
    pred_labels: Ints,
    truth_labels: Ints,
    void: NDArray[np.bool_] | None = None,
    ids: tuple[Ints, Ints] | None = None,
) -> Overlap:
    """Return the overlap of instances given as sets of elements; the sets may overlap each other.

    Parameters
    ----------
    predicted, truth : (P, n) and (T, n) 0/1 matrices, dense or SciPy sparse.
    weights : (n,) float, weight of each element.
    pred_scores, pred_labels, truth_labels : per instance.
    void : (n,) bool, see `overlap_of_faces`.
    ids : ids of the instances; 1, 2, ... if None.
    """
    from scipy import sparse

    a = sparse.csr_matrix(predicted, dtype=np.float64)
    b = sparse.csr_matrix(truth, dtype=np.float64)
    if a.shape[1] != len(weights) or b.shape[1] != len(weights):
        raise InputError(
            f"sets of {a.shape[1]} and {b.shape[1]} elements, but {len(weights)} weights"
        )
    # Sum over sorted columns, so that the IoU of equal sets is exactly 1.
    a.sort_indices()
    b.sort_indices()
    weighted = a.multiply(weights[None, :]).tocsr()
    hidden = np.zeros(len(weights)) if void is None else np.asarray(void, dtype=np.float64)
    names = ids or (np.arange(1, a.shape[0] + 1), np.arange(1, b.shape[0] + 1))
    return Overlap(
        np.asarray((weighted @ b.T).todense(), dtype=np.float64).reshape(a.shape[0], b.shape[0]),
        np.asarray(a @ weights, dtype=np.float64).reshape(-1),
        np.asarray(b @ weights, dtype=np.float64).reshape(-1),
        np.asarray(weighted @ hidden, dtype=np.float64).reshape(-1),
        pred_scores,
        pred_labels,
        truth_labels,
        names[0],
        names[1],
    )

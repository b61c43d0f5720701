"""Precision and recall of the instances that a result shows.

An AP ranks every instance, including low-confidence ones. A climber sees a set without ranks, so
the set has one precision and one recall.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walltopo_lab.evaluate.overlap import Labelled, Overlap


@dataclass(frozen=True)
class OperatingPoint:
    """Precision and recall of a set of instances, at IoU above .5.

    Parameters
    ----------
    shown, truth : number of shown and of true instances.
    hits : shown instances that match a true one; each true instance matches at most once.
    hits_of_class : hits whose class is right too.
    """

    shown: int
    truth: int
    hits: int
    hits_of_class: int

    @property
    def precision(self) -> float:
        """Return the share of shown instances that match a true one; NaN if none is shown."""
        return self.hits / self.shown if self.shown else float("nan")

    @property
    def recall(self) -> float:
        """Return the share of true instances that are matched; NaN without true instances."""
        return self.hits / self.truth if self.truth else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """Return a JSON-able dict; None for a share with denominator 0."""
        both = self.shown + self.truth
        shares = {
            "precision": self.precision,
            "recall": self.recall,
            "f1": 2 * self.hits / both if both else float("nan"),
        }
        return {**self.__dict__, **{k: None if v != v else v for k, v in shares.items()}}


def keep_instances(labelled: Labelled, ids: Collection[int]) -> Labelled:
    """Return the prediction with only the given instances; other faces belong to none."""
    present = np.unique(labelled.face_instance)
    kept = np.isin(present, list(ids)) & (present > 0)
    place = np.searchsorted(present, labelled.face_instance)
    face_instance = np.where(kept[place], labelled.face_instance, 0).astype(np.int32)
    return Labelled(face_instance, labelled.labels, labelled.scores)


def at_score(labelled: Labelled, least: float) -> Labelled:
    """Return the prediction with only the instances that score at least `least`."""
    scores = labelled.scores or {}
    return keep_instances(labelled, {i for i in labelled.labels if scores.get(i, 1.0) >= least})


def operating_point(scenes: Sequence[Overlap], threshold: float = 0.5) -> OperatingPoint:
    """Count the hits of one or several scenes.

    Parameters
    ----------
    threshold : IoU to exceed; from .5 on matches are one-to-one, because the faces of instances are
        disjoint.
    """
    shown = truth = hits = right = 0
    for scene in scenes:
        met = scene.iou() > threshold
        same = scene.pred_labels[:, None] == scene.truth_labels[None, :]
        shown, truth = shown + len(scene.pred_sizes), truth + len(scene.truth_sizes)
        hits += int(met.any(axis=1).sum())
        right += int((met & same).any(axis=1).sum())
    return OperatingPoint(shown, truth, hits, right)

"""The instances that a result shows, rather than all that it ranks.

An AP ranks every instance, doubtful ones included. What a climber sees is a set without ranks:
it has a precision and a recall.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from walltopo_lab.evaluate.overlap import Labelled, Overlap


@dataclass(frozen=True)
class OperatingPoint:
    """How right and how complete a set of instances is, at IoU above .5.

    Parameters
    ----------
    shown, truth : how many instances are shown, how many there are.
    hits : shown ones that meet a true one; each true one is met once at most.
    hits_of_class : those that have its class too.
    """

    shown: int
    truth: int
    hits: int
    hits_of_class: int

    @property
    def precision(self) -> float:
        """Share of the shown that meet a true one; NaN where nothing is shown."""
        return self.hits / self.shown if self.shown else float("nan")

    @property
    def recall(self) -> float:
        """Share of the true ones that are met; NaN where there are none."""
        return self.hits / self.truth if self.truth else float("nan")

    def as_dict(self) -> dict[str, Any]:
        """JSON-able; None where a share is of nothing."""
        both = self.shown + self.truth
        shares = {
            "precision": self.precision,
            "recall": self.recall,
            "f1": 2 * self.hits / both if both else float("nan"),
        }
        return {**self.__dict__, **{k: None if v != v else v for k, v in shares.items()}}


def only(labelled: Labelled, ids: Collection[int]) -> Labelled:
    """A prediction with the instances of these ids only; the faces of others belong to none."""
    present = np.unique(labelled.face_instance)
    kept = np.isin(present, list(ids)) & (present > 0)
    place = np.searchsorted(present, labelled.face_instance)
    face_instance = np.where(kept[place], labelled.face_instance, 0).astype(np.int32)
    return Labelled(face_instance, labelled.labels, labelled.scores)


def at_score(labelled: Labelled, least: float) -> Labelled:
    """A prediction with the instances that score at least this."""
    scores = labelled.scores or {}
    return only(labelled, {i for i in labelled.labels if scores.get(i, 1.0) >= least})


def operating_point(scenes: Sequence[Overlap], threshold: float = 0.5) -> OperatingPoint:
    """Count the hits of one or several scenes.

    Parameters
    ----------
    threshold : IoU that must be exceeded; from .5 on no prediction meets two true ones, nor two
        predictions the same, because the faces of instances are disjoint.
    """
    shown = truth = hits = right = 0
    for scene in scenes:
        met = scene.iou() > threshold
        same = scene.pred_labels[:, None] == scene.truth_labels[None, :]
        shown, truth = shown + len(scene.pred_sizes), truth + len(scene.truth_sizes)
        hits += int(met.any(axis=1).sum())
        right += int((met & same).any(axis=1).sum())
    return OperatingPoint(shown, truth, hits, right)

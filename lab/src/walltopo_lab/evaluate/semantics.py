"""Semantic segmentation by area: intersection over union per class."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.evaluate.overlap import Labelled

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class SemanticMetrics:
    """The IoU of each class over the area of all scenes together.

    Parameters
    ----------
    iou : class id to IoU; 0 is the wall (no object). Classes absent from both sides are omitted.
    miou : mean over all classes, the wall included (as ScanNet's mIoU includes wall and floor).
    miou_objects : mean without the wall.
    """

    iou: Mapping[int, float]
    miou: float
    miou_objects: float

    def as_dict(self) -> dict[str, Any]:
        return {
            "miou": self.miou,
            "miou_objects": None if np.isnan(self.miou_objects) else self.miou_objects,
            "iou": {str(k): v for k, v in self.iou.items()},
        }


def class_of_faces(labelled: Labelled) -> NDArray[np.int64]:
    """Return (F,) class id of each face, 0 = none."""
    table = np.zeros(max([0, *labelled.labels]) + 1, dtype=np.int64)
    for number, label in labelled.labels.items():
        table[number] = label
    return table[labelled.face_instance]


def confusion(
    predicted: NDArray[np.int64], truth: NDArray[np.int64], weights: Floats, classes: int
) -> Floats:
    """Return (classes, classes) weight of the elements by true (row) and predicted class."""
    cells = truth * classes + predicted
    table = np.bincount(cells, weights, minlength=classes * classes).astype(np.float64)
    return table.reshape(classes, classes)


def semantic_metrics(tables: Sequence[Floats]) -> SemanticMetrics:
    """Return the mIoU from the confusion tables (of equal size) of one or several scenes."""
    table = np.sum(tables, axis=0)
    shared = np.diag(table)
    union = table.sum(axis=0) + table.sum(axis=1) - shared
    iou = {int(c): float(shared[c] / union[c]) for c in np.flatnonzero(union > 0)}
    objects = [value for label, value in iou.items() if label != 0]
    return SemanticMetrics(
        iou,
        float(np.mean(list(iou.values()))) if iou else float("nan"),
        float(np.mean(objects)) if objects else float("nan"),
    )

"""AP of 3D instances by the ScanNet and by the COCO protocol.

Example
-------
>>> import numpy as np
>>> truth = Labelled(np.array([1, 1, 2, 0], np.int32), {1: 1, 2: 1})
>>> found = Labelled(np.array([1, 1, 0, 0], np.int32), {1: 1}, {1: 0.9})
>>> evaluate_instances(found, truth, np.ones(4)).agnostic.ap50
0.5
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.evaluate.coco_ap import COCO_THRESHOLDS, coco_ap
from walltopo_lab.evaluate.overlap import Labelled, Overlap, overlap_of_faces
from walltopo_lab.evaluate.scannet import SCANNET_THRESHOLDS, scannet_ap

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class ApSummary:
    """The AP metrics of one class (or of all classes as one).

    Parameters
    ----------
    ap, ap50, ap25 : ScanNet protocol: mean over .50 to .90, at .50, at .25.
    coco_ap, coco_ap50, coco_ap75, coco_ap25 : COCO protocol: mean over .50:.95, at one threshold.
    coco_ap90 : COCO's matching with ScanNet's nine thresholds (mean over .50 to .90).
    truth, predicted : number of counted instances.
    """

    ap: float
    ap50: float
    ap25: float
    coco_ap: float
    coco_ap50: float
    coco_ap75: float
    coco_ap25: float
    coco_ap90: float
    truth: int
    predicted: int

    def as_dict(self) -> dict[str, float | int | None]:
        """Return a JSON-able dict; None if the class has no truth."""
        return {k: None if v != v else v for k, v in self.__dict__.items()}


@dataclass(frozen=True)
class InstanceMetrics:
    """AP metrics of one labelled mesh, or of several pooled meshes.

    Parameters
    ----------
    agnostic : every instance as one class.
    per_class : class id to its metrics; classes that occur in truth or prediction.
    mean : mean of `per_class` over the classes with truth (mAP).
    """

    agnostic: ApSummary
    per_class: Mapping[int, ApSummary]
    mean: ApSummary

    def as_dict(self) -> dict[str, Any]:
        return {
            "agnostic": self.agnostic.as_dict(),
            "mean": self.mean.as_dict(),
            "per_class": {str(k): v.as_dict() for k, v in self.per_class.items()},
        }


def _summary(scenes: Sequence[Overlap], min_size: float) -> ApSummary:
    scannet = scannet_ap(scenes, (*SCANNET_THRESHOLDS, 0.25), min_size)
    coco = coco_ap(scenes, (*COCO_THRESHOLDS, 0.25), min_size)
    return ApSummary(
        ap=float(scannet[:-1].mean()),
        ap50=float(scannet[0]),
        ap25=float(scannet[-1]),
        coco_ap=float(coco[:-1].mean()),
        coco_ap50=float(coco[0]),
        coco_ap75=float(coco[5]),
        coco_ap25=float(coco[-1]),
        coco_ap90=float(coco[:9].mean()),
        truth=sum(int((s.truth_sizes >= min_size).sum()) for s in scenes),
        predicted=sum(len(s.pred_sizes) for s in scenes),
    )


def _mean(parts: Sequence[ApSummary]) -> ApSummary:
    with_truth = [part.as_dict() for part in parts if part.truth > 0]
    values: dict[str, Any] = {
        name: float(np.mean([part[name] for part in with_truth])) if with_truth else float("nan")
        for name in ApSummary.__dataclass_fields__
    }
    values["truth"] = sum(part.truth for part in parts)
    values["predicted"] = sum(part.predicted for part in parts)
    return ApSummary(**values)


def summarise_instances(scenes: Sequence[Overlap], min_size: float = 0.0) -> InstanceMetrics:
    """Return all AP metrics of one or several scenes, pooled as in the benchmarks."""
    present = {int(c) for s in scenes for c in (*s.pred_labels, *s.truth_labels)}
    per_class = {c: _summary([s.select(c) for s in scenes], min_size) for c in sorted(present)}
    return InstanceMetrics(_summary(scenes, min_size), per_class, _mean(tuple(per_class.values())))


def evaluate_instances(
    predicted: Labelled,
    truth: Labelled,
    areas: Floats,
    ignored: NDArray[np.bool_] | None = None,
    void: NDArray[np.bool_] | None = None,
    min_size: float = 0.0,
) -> InstanceMetrics:
    """Return the AP of predicted instances on the same mesh as the truth.

    Parameters
    ----------
    predicted, truth : labels of the same F faces.
    areas : (F,) float, area of each face (or ones, to count faces as ScanNet counts vertices).
    ignored : (F,) bool, faces to exclude: those that no photo saw (`face_views == 0`).
    void : (F,) bool, ScanNet's void; see `overlap_of_faces`.
    min_size : smaller true instances are ignored, in the unit of `areas`; off by default.
    """
    return summarise_instances([overlap_of_faces(predicted, truth, areas, ignored, void)], min_size)

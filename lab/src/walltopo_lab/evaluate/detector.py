"""COCO metrics of 2D detections against labelled photos, for boxes and masks (faster-coco-eval)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.scans.segmentation import encode_mask
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.shapes import mask_of

Floats = NDArray[np.float64]

# COCO's cap of 100 detections is too low: one photo of a wall contains more holds.
MAX_DETECTIONS = 1000
# Square root of the object's area in pixels; "over 40 px" is ours, the others are COCO's.
SIZES: Mapping[str, tuple[float, float]] = {
    "all": (0, 1e5),
    "small": (0, 32),
    "medium": (32, 96),
    "large": (96, 1e5),
    "over 40 px": (40, 1e5),
}
RECALLS = np.linspace(0, 1, 101)


@dataclass(frozen=True, eq=False)
class DetectorFigures:
    """COCO metrics of one run (boxes or masks) for one class, or for all classes merged.

    Parameters
    ----------
    ap, ap50, ap75 : average precision over .50:.95, at .50, at .75.
    ap100 : `ap` under COCO's cap of 100 detections a photo.
    ar : average recall over .50:.95.
    recall50 : by size class (see `SIZES`), recall at IoU .50 of all detections.
    ap_size : by size class, average precision over .50:.95.
    objects : number of labelled objects.
    precision50, precision75 : (101,) precision at the recalls 0, .01, ... 1.
    """

    ap: float
    ap50: float
    ap75: float
    ap100: float
    ar: float
    recall50: Mapping[str, float]
    ap_size: Mapping[str, float]
    objects: int
    precision50: Floats = field(repr=False)
    precision75: Floats = field(repr=False)

    def as_dict(self) -> dict[str, Any]:
        plain = {k: v for k, v in self.__dict__.items() if not k.startswith("precision")}
        return _without_nan(plain)


@dataclass(frozen=True)
class DetectorMetrics:
    """All metrics of a detector.

    Parameters
    ----------
    boxes, masks : "all" (classes as one), each class by name, and "mean" of the classes; masks are
        empty if the truth has only boxes.
    photos : number of photos compared.
    """

    boxes: Mapping[str, DetectorFigures]
    masks: Mapping[str, DetectorFigures]
    photos: int

    def as_dict(self) -> dict[str, Any]:
        return {
            "photos": self.photos,
            "boxes": {name: f.as_dict() for name, f in self.boxes.items()},
            "masks": {name: f.as_dict() for name, f in self.masks.items()},
        }


def _without_nan(value: Any) -> Any:
    if isinstance(value, dict):
        return {k: _without_nan(v) for k, v in value.items()}
    return None if isinstance(value, float) and np.isnan(value) else value


def _rows(
    photos: Sequence[Photo], names: Mapping[int, str], numbers: Mapping[str, int], kind: str
) -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = []
    for image_id, photo in enumerate(photos, start=1):
        for annotation in photo.annotations:
            number = numbers.get(names[annotation.label])
            if number is None:
                continue
            row = {"id": len(rows) + 1, "image_id": image_id, "category_id": number}
            rows.append(row | _geometry(annotation, photo, kind) | {"iscrowd": 0})
    return rows


def _geometry(annotation: Annotation, photo: Photo, kind: str) -> dict[str, Any]:
    shared = {"bbox": list(annotation.box), "score": annotation.score}
    if kind == "bbox":
        return shared | {"area": annotation.box[2] * annotation.box[3]}
    mask = mask_of(annotation, photo)
    return shared | {"segmentation": encode_mask(mask), "area": mask.area}


def _figures(
    truth: list[dict[str, Any]],
    found: list[dict[str, Any]],
    images: list[dict[str, Any]],
    kind: str,
    number: int,
) -> DetectorFigures:
    from faster_coco_eval import COCO, COCOeval_faster

    truth = [row for row in truth if number in (0, row["category_id"])]
    found = [row for row in found if number in (0, row["category_id"])]
    reference, result = (
        COCO(
            {
                "images": images,
                "categories": [{"id": 1, "name": "object"}],
                "annotations": [row | {"category_id": 1} for row in rows],
            }
        )
        for rows in (truth, found)
    )
    evaluation = COCOeval_faster(reference, result, kind)
    evaluation.params.maxDets = [100, MAX_DETECTIONS]
    evaluation.params.areaRng = [[low**2, high**2] for low, high in SIZES.values()]
    evaluation.params.areaRngLbl = list(SIZES)
    evaluation.evaluate()
    evaluation.accumulate()
    return _summary(evaluation.eval, len(truth))


def _summary(result: Mapping[str, Any], objects: int) -> DetectorFigures:
    # precision: (thresholds, recalls, classes, sizes, caps); -1 without truth.
    precision = np.where(result["precision"] < 0, np.nan, result["precision"])[:, :, 0]
    recall = np.where(result["recall"] < 0, np.nan, result["recall"])[:, 0]
    ap = precision.mean(axis=1)
    return DetectorFigures(
        ap=float(ap[:, 0, 1].mean()),
        ap50=float(ap[0, 0, 1]),
        ap75=float(ap[5, 0, 1]),
        ap100=float(ap[:, 0, 0].mean()),
        ar=float(recall[:, 0, 1].mean()),
        recall50={name: float(recall[0, k, 1]) for k, name in enumerate(SIZES)},
        ap_size={name: float(ap[:, k, 1].mean()) for k, name in enumerate(SIZES)},
        objects=objects,
        precision50=precision[0, :, 0, 1],
        precision75=precision[5, :, 0, 1],
    )


def _mean(parts: Sequence[DetectorFigures]) -> DetectorFigures:
    def average(values: Sequence[float]) -> float:
        known = [v for v in values if not np.isnan(v)]
        return float(np.mean(known)) if known else float("nan")

    simple = {
        name: average([getattr(part, name) for part in parts])
        for name in ("ap", "ap50", "ap75", "ap100", "ar")
    }
    return DetectorFigures(
        **simple,
        recall50={s: average([part.recall50[s] for part in parts]) for s in SIZES},
        ap_size={s: average([part.ap_size[s] for part in parts]) for s in SIZES},
        objects=sum(part.objects for part in parts),
        precision50=np.mean([part.precision50 for part in parts], axis=0),
        precision75=np.mean([part.precision75 for part in parts], axis=0),
    )


def _paired(found: Dataset, truth: Dataset) -> tuple[list[Photo], list[Photo]]:
    by_stem = {photo.name.rsplit(".", 1)[0]: photo for photo in found.photos}
    pairs = [(by_stem.get(p.name.rsplit(".", 1)[0]), p) for p in truth.photos]
    if not any(mine for mine, _ in pairs):
        raise InputError("none of the detections belongs to a labelled photo")
    for mine, true in pairs:
        if mine and (mine.width, mine.height) != (true.width, true.height):
            raise InputError(
                f"{true.name}: detections of {mine.width}x{mine.height}, "
                f"labels of {true.width}x{true.height}",
                "Detect on the very photos that are labelled.",
            )
    # A labelled photo without an entry counts as a photo without detections.
    empty = [mine or true.with_annotations(()) for mine, true in pairs]
    return empty, [true for _, true in pairs]


def evaluate_detections(found: Dataset, truth: Dataset) -> DetectorMetrics:
    """Return COCO's metrics of detections.

    Classes match by name, photos by the stem of their name.

    Parameters
    ----------
    found : detections, with scores.
    truth : labels. Masks are compared only if every labelled object has a shape.

    Raises
    ------
    InputError : no common photo, or different photo sizes.
    """
    mine, true = _paired(found, truth)
    names = sorted({*truth.classes.values()})
    numbers = {name: k for k, name in enumerate(names, start=1)}
    kinds = ["bbox"]
    if all(a.has_shape for p in true for a in p.annotations):
        kinds.append("segm")
    images = [{"id": k, "width": p.width, "height": p.height} for k, p in enumerate(true, start=1)]
    runs: dict[str, dict[str, DetectorFigures]] = {"bbox": {}, "segm": {}}
    for kind in kinds:
        expected = _rows(true, truth.classes, numbers, kind)
        given = _rows(mine, found.classes, numbers, kind)
        runs[kind]["all"] = _figures(expected, given, images, kind, 0)
        for name, number in numbers.items():
            runs[kind][name] = _figures(expected, given, images, kind, number)
        parts = [runs[kind][name] for name in names if runs[kind][name].objects]
        if parts:
            runs[kind]["mean"] = _mean(parts)
    return DetectorMetrics(runs["bbox"], runs["segm"], len(true))


def figures_table(metrics: DetectorMetrics) -> Any:
    """Return a rich table with one row per class and run."""
    from rich import box
    from rich.table import Table

    heads = ("AP50", "AP", "AP75", "AR", "APs", "APm", "APl", "R>40px", "n")
    table = Table(
        "",
        *heads,
        box=box.SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        title=f"detections on {metrics.photos} photos",
        caption="s, m, l: under 32, 32 to 96, over 96 px; R>40px: recall at IoU .50 over 40 px",
    )
    for run, rows in (("boxes", metrics.boxes), ("masks", metrics.masks)):
        for name, f in rows.items():
            values = [f.ap50, f.ap, f.ap75, f.ar]
            values += [f.ap_size[s] for s in ("small", "medium", "large")]
            values.append(f.recall50["over 40 px"])
            cells = ["-" if np.isnan(v) else f"{v:.3f}" for v in values]
            table.add_row(f"{run}, {name}", *cells, str(f.objects))
    return table

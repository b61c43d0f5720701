"""Figures of a detector on photos it never saw.

    python -m walltopo_lab.benchmarks.detectors [DATA] [--model NAME|FILE] [--sets valid,masks] [--every N]

DATA is the folder of the test data (default ../shared/data). Printed per set: COCO's figures
(at most 1,000 detections a photo, score from 0.03) of the network's boxes and of its
masks; recall and precision by object size at the model's own threshold; time a photo. A time to
quote needs an otherwise idle machine; CPU time hardly depends on that.

`valid` is hold-boxes/valid, `masks` is hold-masks (a gym that no training photo shows),
`spraywall` the two labelled photos of that wall. `python -m walltopo_lab.benchmarks.detectors --time` only
measures time.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table

from walltopo.detect.contract import DetectSettings
from walltopo.detect.detector import Detector, open_detector
from walltopo.detect.found import Found, box_iou
from walltopo.detect.onnx_detector import OnnxDetector
from walltopo.imaging.photo_file import read_rgb
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.evaluate.detector import evaluate_detections, figures_table

SETS = {
    "valid": "hold-boxes/valid",
    "masks": "hold-masks/annotations.json",
    "spraywall": "spraywall",
}
BINS = ((0, 16), (16, 40), (40, 96), (96, 10_000))  # px, root of the box area
LOW_SCORE = 0.03


@dataclass(frozen=True, eq=False)
class Outcome:
    """What a detector found in a set, and how long it took."""

    found: list[Found]
    seconds: list[float]
    cpu: list[float]


def look(detector: Detector, photos: list[Path]) -> Outcome:
    """Run the detector, the reading of the files not counted."""
    outcome = Outcome([], [], [])
    for path in photos:
        photo = read_rgb(path)
        wall, cpu = time.perf_counter(), time.process_time()
        outcome.found.append(detector.detect(photo))
        outcome.seconds.append(time.perf_counter() - wall)
        outcome.cpu.append(time.process_time() - cpu)
    return outcome


def as_dataset(truth: Dataset, found: list[Found], classes: dict[int, str], masks: bool) -> Dataset:
    """Detections as a data set: with masks, or with the network's own boxes only."""
    photos = []
    for photo, seen in zip(truth.photos, found, strict=True):
        annotations = []
        for k in range(len(seen)):
            x0, y0, x1, y1 = (float(v) for v in seen.boxes[k])
            annotation = Annotation(
                int(seen.labels[k]), (x0, y0, x1 - x0, y1 - y0), score=float(seen.scores[k])
            )
            if masks:
                mask = seen.masks[k]
                x, y, w, h = mask.box
                annotation = replace(annotation, mask=mask, box=(x, y, w, h))
            annotations.append(annotation)
        photos.append(photo.with_annotations(tuple(annotations)))
    return Dataset(tuple(photos), classes)


def boxes_of(photo: Photo) -> NDArray[np.float64]:
    """Labelled boxes (n, 4), x0, y0, x1, y1."""
    boxes = np.array([a.box for a in photo.annotations], dtype=np.float64).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def by_size(truth: Dataset, found: list[Found], least: dict[int, float]) -> Table:
    """Recall and precision at the operating thresholds, boxes at 0.5 IoU, classes as one."""
    wanted, got, right, said = (np.zeros(len(BINS), int) for _ in range(4))
    for photo, seen in zip(truth.photos, found, strict=True):
        boxes = boxes_of(photo)
        limit = np.array([least[int(label)] for label in seen.labels])
        seen = seen.pick(np.flatnonzero(seen.scores >= limit))
        taken = np.zeros(len(boxes), bool)
        overlap = box_iou(seen.boxes, boxes)
        for k in np.argsort(-seen.scores):
            said[bin_of(seen.boxes[k])] += 1
            if len(boxes):
                best = int(np.where(taken, -1, overlap[k]).argmax())
                if not taken[best] and overlap[k, best] >= 0.5:
                    taken[best] = True
                    right[bin_of(seen.boxes[k])] += 1
        for box, hit in zip(boxes, taken, strict=True):
            wanted[bin_of(box)] += 1
            got[bin_of(box)] += hit
    table = Table("size (px)", "objects", "recall", "detections", "precision")
    for k, (low, high) in enumerate(BINS):
        name = f"{low} to {high}" if high < 10_000 else f"over {low}"
        recall, precision = got[k] / max(wanted[k], 1), right[k] / max(said[k], 1)
        table.add_row(name, str(wanted[k]), f"{recall:.3f}", str(said[k]), f"{precision:.3f}")
    table.add_row(
        "all",
        str(wanted.sum()),
        f"{got.sum() / wanted.sum():.3f}",
        str(said.sum()),
        f"{right.sum() / max(said.sum(), 1):.3f}",
    )
    table.title = f"at least scores {', '.join(f'{score:.2f}' for score in least.values())}"
    return table


def thresholds(detector: Detector) -> dict[int, float]:
    """The least scores in use, by label."""
    if isinstance(detector, OnnxDetector):
        return detector.scores
    return dict.fromkeys(detector.classes, float(getattr(detector, "score", 0.3)))


def bin_of(box: NDArray[np.float64]) -> int:
    """Number of the size class of a box."""
    side = float(np.sqrt(max((box[2] - box[0]) * (box[3] - box[1]), 0.0)))
    return next(k for k, (low, high) in enumerate(BINS) if low <= side < high)


def report(
    console: Console, name: str, path: Path, settings: DetectSettings, every: int = 1
) -> None:
    """Print everything about one set, or about every n-th photo of it."""
    truth = read_dataset(path)
    labelled = tuple(p for p in truth.photos if p.annotations and p.path is not None)
    # A YOLO folder without a data.yaml names no classes; all sets here number them alike.
    truth = Dataset(labelled[::every], {1: "hold", 2: "volume"})
    detector = open_detector(replace(settings, score=LOW_SCORE))
    outcome = look(detector, [p.path for p in truth.photos if p.path is not None])
    console.rule(f"{name}: {len(truth.photos)} photos, {detector.description}")
    boxes = as_dataset(truth, outcome.found, detector.classes, masks=False)
    console.print("boxes as the network measures them")
    console.print(figures_table(evaluate_detections(boxes, plain_boxes(truth))))
    if all(f.masks for f in outcome.found if len(f)):
        masks = as_dataset(truth, outcome.found, detector.classes, masks=True)
        console.print("masks, and the boxes around the masks")
        console.print(figures_table(evaluate_detections(masks, truth)))
    console.print(by_size(truth, outcome.found, thresholds(open_detector(settings))))
    print_time(console, outcome)


def plain_boxes(truth: Dataset) -> Dataset:
    """The set without its shapes, so that boxes are compared with boxes."""
    return Dataset(
        tuple(
            p.with_annotations(tuple(Annotation(a.label, a.box) for a in p.annotations))
            for p in truth.photos
        ),
        truth.classes,
    )


def print_time(console: Console, outcome: Outcome) -> None:
    """Median time a photo, the first (loading) not counted."""
    wall, cpu = np.median(outcome.seconds[1:]), np.median(outcome.cpu[1:])
    console.print(f"{wall:.3f} s a photo ({cpu:.3f} CPU-s), {len(outcome.seconds)} photos\n")


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--model", default="onnx")
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--size", type=int, default=DetectSettings.size)
    parser.add_argument("--again", type=float, default=DetectSettings.again)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="look at every n-th photo only")
    parser.add_argument("--time", action="store_true", help="only time, on the gym-a photos")
    args = parser.parse_args()
    settings = DetectSettings(
        model=args.model, size=args.size, again=args.again, threads=args.threads
    )
    console = Console(width=120)
    if args.time:
        photos = sorted((args.data / "gym-a" / "photos").iterdir())[:12]
        print_time(console, look(open_detector(settings), photos))
        return
    for name in args.sets.split(","):
        report(console, name, args.data / SETS[name], settings, args.every)


if __name__ == "__main__":
    main()

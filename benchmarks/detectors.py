"""Figures of a detector on photos outside its training.

    python -m benchmarks.detectors [DATA] [--model NAME|FILE] [--sets valid,masks] [--every N]

DATA is the folder of the test data (default ../shared/data). The output per set: COCO's figures (at
most 1,000 detections a photo, score from 0.03) of the network's boxes, of its masks and of the
boxes around them; recall and precision by object size at the model's own threshold; time a photo.
Times for publication need an otherwise idle machine; CPU time hardly depends on the load.

`valid` is hold-boxes/valid, `masks` is hold-masks (a gym in no training photo), `spraywall` the two
labelled photos of that wall. `python -m benchmarks.detectors --time` measures only
time, `--precisions` compares the shipped network with its quantized copy in one run.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from walltopo.segment.detect.detector import Detector, open_detector
from walltopo.segment.detect.onnx_detector import OnnxDetector
from walltopo.segment.detect.photo_detections import PhotoDetections, box_iou
from walltopo.segment.settings import DetectSettings
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.evaluate.detector import DetectorFigures, DetectorMetrics, evaluate_detections
from walltopo_lab.evaluate.looks import LOW_SCORE, Outcome, as_dataset, detect_photos, plain_boxes

SETS = {
    "valid": "hold-boxes/valid",
    "masks": "hold-masks/annotations.json",
    "spraywall": "spraywall",
}
# Map the evaluator's names to the page's; the mean of classes first, as in publications.
ROWS = {"mean": "mean of classes", "all": "classes as one", "hold": "hold", "volume": "volume"}
BINS = ((0, 16), (16, 40), (40, 96), (96, 10_000))  # px, square root of the box area


def boxes_of(photo: Photo) -> NDArray[np.float64]:
    """Return labelled boxes (n, 4), x0, y0, x1, y1."""
    boxes = np.array([a.box for a in photo.annotations], dtype=np.float64).reshape(-1, 4)
    boxes[:, 2:] += boxes[:, :2]
    return boxes


def by_size(truth: Dataset, found: list[PhotoDetections], least: dict[int, float]) -> Iterator[str]:
    """Yield the table lines of recall and precision at the operating thresholds.

    Boxes match at 0.5 IoU, with the classes merged.
    """
    wanted, got, right, reported = (np.zeros(len(BINS), int) for _ in range(4))
    for photo, seen in zip(truth.photos, found, strict=True):
        boxes = boxes_of(photo)
        limit = np.array([least[int(label)] for label in seen.labels])
        seen = seen.pick(np.flatnonzero(seen.scores >= limit))
        taken = np.zeros(len(boxes), bool)
        overlap = box_iou(seen.boxes, boxes)
        for k in np.argsort(-seen.scores):
            reported[bin_of(seen.boxes[k])] += 1
            if len(boxes):
                best = int(np.where(taken, -1, overlap[k]).argmax())
                if not taken[best] and overlap[k, best] >= 0.5:
                    taken[best] = True
                    right[bin_of(seen.boxes[k])] += 1
        for box, hit in zip(boxes, taken, strict=True):
            wanted[bin_of(box)] += 1
            got[bin_of(box)] += hit
    sums = [np.append(counts, counts.sum()) for counts in (wanted, got, right, reported)]
    heads = [f"{low} to {high}" if high < 10_000 else f"over {low}" for low, high in BINS]
    yield f"| size (px) | {' | '.join(heads)} | all |"
    yield f"|---|{'---|' * len(sums[0])}"
    yield f"| objects | {' | '.join(str(n) for n in sums[0])} |"
    for name, met, total in (("recall", sums[1], sums[0]), ("precision", sums[2], sums[3])):
        shares = met / np.maximum(total, 1)
        yield f"| {name} | {' | '.join(f'{share:.3f}' for share in shares)} |"


def coco_rows(what: str, figures: Mapping[str, DetectorFigures]) -> Iterator[str]:
    """Yield the rows of COCO's table for one kind of outline."""
    for key, name in ROWS.items():
        if key in figures:
            f = figures[key]
            values = (f.ap50, f.ap, f.ap75, f.ar, f.recall50["over 40 px"])
            cells = ("-" if np.isnan(v) else f"{v:.3f}" for v in values)
            yield f"| {what}, {name} | {' | '.join(cells)} | {f.objects} |"


def thresholds(detector: Detector) -> dict[int, float]:
    """Return the minimum scores in use, by label."""
    if isinstance(detector, OnnxDetector):
        return detector.thresholds
    return dict.fromkeys(detector.classes, float(getattr(detector, "score", 0.3)))


def bin_of(box: NDArray[np.float64]) -> int:
    """Return the index of a box's size class."""
    side = float(np.sqrt(max((box[2] - box[0]) * (box[3] - box[1]), 0.0)))
    return next(k for k, (low, high) in enumerate(BINS) if low <= side < high)


def read_labelled(path: Path, every: int = 1) -> Dataset:
    """Return the labelled photos of a set, or every n-th of them."""
    truth = read_dataset(path)
    labelled = tuple(p for p in truth.photos if p.annotations and p.path is not None)
    # A YOLO folder without a data.yaml names no classes; all sets here use the same numbers.
    return Dataset(labelled[::every], {1: "hold", 2: "volume"})


def look_at(truth: Dataset, settings: DetectSettings) -> tuple[Detector, Outcome]:
    """Return the detector and what it finds down to a low score."""
    detector = open_detector(replace(settings, score=LOW_SCORE))
    return detector, detect_photos(detector, [p.path for p in truth.photos if p.path is not None])


def box_metrics(truth: Dataset, detector: Detector, outcome: Outcome) -> DetectorMetrics:
    """Return the metrics of the network's own boxes."""
    found = as_dataset(truth, outcome.found, detector.classes, masks=False)
    return evaluate_detections(found, plain_boxes(truth))


def mask_metrics(truth: Dataset, detector: Detector, outcome: Outcome) -> DetectorMetrics:
    """Return the metrics of the masks, and of the boxes around them."""
    found = as_dataset(truth, outcome.found, detector.classes, masks=True)
    return evaluate_detections(found, truth)


def compare_precisions(data: Path, settings: DetectSettings, every: int) -> None:
    """Print AP50 (mean of the classes) and time of float32 and 8-bit numbers."""
    print("| numbers | `valid`, boxes | `masks`, boxes | `masks`, masks | CPU-s a photo |")
    print("|---|---|---|---|---|")
    sets = {name: read_labelled(data / SETS[name], every) for name in ("valid", "masks")}
    precisions: tuple[Literal["float", "int8"], ...] = ("float", "int8")
    for precision in precisions:
        cells, cpu = [], []
        for name, truth in sets.items():
            detector, outcome = look_at(truth, replace(settings, precision=precision))
            cpu += outcome.cpu[1:]
            cells.append(box_metrics(truth, detector, outcome).boxes["mean"].ap50)
            if name == "masks":
                cells.append(mask_metrics(truth, detector, outcome).masks["mean"].ap50)
        values = " | ".join(f"{value:.3f}" for value in cells)
        print(f"| {precision} | {values} | {np.median(cpu):.3f} |")


def report(name: str, path: Path, settings: DetectSettings, every: int = 1) -> None:
    """Print all figures of one set, or of every n-th photo of it."""
    truth = read_labelled(path, every)
    detector, outcome = look_at(truth, settings)
    print(f"{name}: {len(truth.photos)} photos, {detector.description}\n")
    print(
        "| | AP50 | AP | AP75 | AR | recall over 40 px | objects |\n|---|---|---|---|---|---|---|"
    )
    print(*coco_rows("boxes", box_metrics(truth, detector, outcome).boxes), sep="\n")
    if all(f.masks for f in outcome.found if len(f)):
        figures = mask_metrics(truth, detector, outcome)
        rows = [*coco_rows("masks", figures.masks), *coco_rows("boxes around masks", figures.boxes)]
        print(*rows, sep="\n")
    least = thresholds(open_detector(settings))
    scores = ", ".join(f"{detector.classes[label]} {score:.2f}" for label, score in least.items())
    print(f"\nat least scores {scores}, boxes at IoU 0.5, classes as one:\n")
    print(*by_size(truth, outcome.found, least), sep="\n")
    print_time(outcome)


def print_time(outcome: Outcome) -> None:
    """Print the median time a photo, without the first (which includes loading)."""
    wall, cpu = np.median(outcome.seconds[1:]), np.median(outcome.cpu[1:])
    print(f"\n{wall:.3f} s a photo ({cpu:.3f} CPU-s), {len(outcome.seconds)} photos")


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--model", default="onnx")
    parser.add_argument("--sets", default=",".join(SETS))
    parser.add_argument("--size", type=int, default=DetectSettings.size)
    parser.add_argument("--again", type=float, default=DetectSettings.again)
    parser.add_argument("--threads", type=int, default=0)
    parser.add_argument("--every", type=int, default=1, help="look at every n-th photo only")
    parser.add_argument("--time", action="store_true", help="only time, on the gym-a photos")
    parser.add_argument("--precision", default="auto", choices=("auto", "float", "int8"))
    parser.add_argument("--precisions", action="store_true", help="compare float and int8")
    args = parser.parse_args()
    settings = DetectSettings(
        model=args.model,
        size=args.size,
        again=args.again,
        threads=args.threads,
        precision=args.precision,
    )
    if args.precisions:
        compare_precisions(args.data, settings, args.every)
        return
    if args.time:
        photos = sorted((args.data / "gym-a" / "photos").iterdir())[:12]
        print_time(detect_photos(open_detector(settings), photos))
        return
    for name in args.sets.split(","):
        report(name, args.data / SETS[name], settings, args.every)


if __name__ == "__main__":
    main()

"""The vote network against yolo11s-seg: same photos, same pseudo-masks, same minutes, one thread.

    python -m walltopo_lab.benchmarks.yardstick [DATA] [-o FOLDER] [--minutes 15] [--model yolo11s-seg]

DATA is the folder of the test data (default ../shared/data). Both start from fresh weights on
hold-boxes/train without its held-out photos (`walltopo train`, their own default settings and
augmentation), one after the other, and stop after so many minutes of training; run it on an
otherwise idle machine. Printed: AP50 of boxes on hold-boxes/valid (every n-th photo, `--every`)
and of masks on hold-masks. Needs the `[ultralytics]` extra for the second; run again to go on.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from walltopo.core import Silent
from walltopo.detect.contract import DetectSettings
from walltopo.detect.detector import open_detector
from walltopo_lab.benchmarks.detectors import LOW_SCORE, as_dataset, look, plain_boxes
from walltopo_lab.datasets.model import Dataset
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.evaluate.detector import evaluate_detections
from walltopo_lab.train.detector import Job, train_detector
from walltopo_lab.train.params import AUGMENTS, TrainSettings, YoloSettings
from walltopo_lab.train.yolo import train_yolo

CLASSES = {1: "hold", 2: "volume"}


def trained(data: Path, out: Path, name: str, minutes: float) -> Path:
    """The exported network of a run; resumes."""
    job = Job((data / "hold-boxes" / "train",), out / name, cache=out / "cache")
    model = job.out / "holds.onnx"
    if model.is_file():
        return model
    if name == "votes":
        settings = TrainSettings(minutes=minutes, threads=1, check_every=minutes / 6)
        train_detector(job, settings, AUGMENTS["default"], Silent())
    else:
        yolo = YoloSettings(minutes=minutes, threads=1)
        train_yolo(job, name, yolo, AUGMENTS["default"], Silent())
    return model


def labelled(path: Path, every: int) -> Dataset:
    """Every n-th photo with labels and a picture."""
    photos = tuple(p for p in read_dataset(path).photos if p.annotations and p.path is not None)
    return Dataset(photos[::every], CLASSES)


def row(name: str, model: Path, data: Path, every: int) -> str:
    """Figures of one network: boxes on valid, masks on the gym that no photo shows."""
    settings = DetectSettings(model=str(model), score=LOW_SCORE)
    # Ultralytics' networks look at photos at the size they were trained for.
    detector = open_detector(settings if name == "votes" else replace(settings, size=640))
    cells = []
    valid = labelled(data / "hold-boxes" / "valid", every)
    seen = look(detector, [p.path for p in valid.photos if p.path])
    found = as_dataset(valid, seen.found, CLASSES, masks=False)
    boxes = evaluate_detections(found, plain_boxes(valid)).boxes
    cells += [boxes[k].ap50 for k in ("all", "hold", "volume")]
    masks = labelled(data / "hold-masks" / "annotations.json", 1)
    seen = look(detector, [p.path for p in masks.photos if p.path])
    found = as_dataset(masks, seen.found, CLASSES, masks=True)
    cells.append(evaluate_detections(found, masks).masks["all"].ap50)
    return f"| {name} | {' | '.join(f'{value:.3f}' for value in cells)} |"


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("-o", "--out", type=Path, default=Path("yardstick"))
    parser.add_argument("--minutes", type=float, default=15.0)
    parser.add_argument("--model", default="yolo11s-seg")
    parser.add_argument("--every", type=int, default=1)
    args = parser.parse_args()
    console = Console(width=120)
    console.print(f"{args.minutes:g} minutes each, AP50\n")
    console.print("| network | boxes, valid | hold | volume | masks, hold-masks |")
    console.print("|---|---|---|---|---|")
    for name in ("votes", args.model):
        model = trained(args.data, args.out, name, args.minutes)
        console.print(row(name, model, args.data, args.every), markup=False)


if __name__ == "__main__":
    main()

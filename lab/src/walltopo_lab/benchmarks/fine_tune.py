"""Photos that a gym needs for fine-tuning: the shipped network trained on 2, 4, 8 of them.

    python -m walltopo_lab.benchmarks.fine_tune [DATA] [-o FOLDER] [--minutes 2] [--photos 2 4 8]

DATA is the folder of the test data (default ../shared/data). Per gym and number of photos:
`walltopo train --pretrained onnx` runs for `--minutes` on evenly drawn photos, then AP50 before and
after is measured on the other photos (of gym-a on twelve of them), at all scores from 0.03. The
networks stay in FOLDER, because both gyms are for reporting only. gym-a's labels are the true mesh
drawn into the photos. hold-masks has nine photos in all, so eight training photos leave one.
Figures already in FOLDER are kept.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from walltopo.core import Camera, Silent, View
from walltopo.core.files import read_json, write_json
from walltopo.segment.detect.detector import open_detector, shipped_model
from walltopo.segment.settings import DetectSettings
from walltopo_lab.benchmarks.detectors import LOW_SCORE, as_dataset, look, plain_boxes
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.read import read_dataset, write_dataset
from walltopo_lab.evaluate.detector import evaluate_detections

CLASSES = {1: "hold", 2: "volume"}
MAX_TEST = 12


def gym_a(data: Path) -> Dataset:
    """Return every third of gym-a's 60 photos, with the masks of its true mesh."""
    from walltopo_lab.datasets.project import project_labels
    from walltopo_lab.evaluate.truth import read_truth

    gym = data / "gym-a"
    exact = read_truth(gym)
    camera = Camera("SIMPLE_RADIAL", 1280, 960, (947.2, 640.0, 480.0, 0.035))
    names = sorted(exact.views)[:60:3]
    views = [View(name, camera, exact.views[name].cam_from_world) for name in names]
    labels = exact.labelled.labels
    return project_labels(exact.mesh, exact.face_instance, labels, CLASSES, views, gym / "photos")


def hold_masks(data: Path) -> Dataset:
    """Return the nine photos of an old dark gym."""
    return replace(read_dataset(data / "hold-masks" / "annotations.json"), classes=CLASSES)


GYMS = {"gym-a": gym_a, "hold-masks": hold_masks}


def parted(dataset: Dataset, count: int) -> tuple[Dataset, Dataset]:
    """Return `count` evenly drawn photos, and the rest (at most `MAX_TEST`, evenly)."""
    photos = dataset.photos
    chosen = {round(k) for k in np.linspace(0, len(photos) - 1, count)}
    rest = [p for k, p in enumerate(photos) if k not in chosen]
    kept = np.linspace(0, len(rest) - 1, min(MAX_TEST, len(rest))).round().astype(int)
    train = tuple(photos[k] for k in sorted(chosen))
    return Dataset(train, CLASSES), Dataset(tuple(rest[k] for k in kept), CLASSES)


def fine_tune(train: Dataset, out: Path, minutes: float) -> Path:
    """Train the shipped network further on a few photos and return the model; a stopped run
    resumes.
    """
    from walltopo_lab.train.detector import Job, train_detector
    from walltopo_lab.train.params import AugmentSettings, TrainSettings

    model = out / "run" / "holds.onnx"
    if not model.is_file():
        write_dataset(out / "photos", train, "coco-rle")
        settings = TrainSettings(
            minutes=minutes, rate=3e-4, held_out=0.0, audit=0.0, check_every=1e3, check_photos=2
        )
        labels = (out / "photos" / "annotations.json",)
        job = Job(labels, out / "run", pretrained=shipped_model())
        train_detector(job, settings, AugmentSettings(), Silent())
    return model


def figures(model: Path, test: Dataset) -> dict[str, float]:
    """Return AP50 of boxes and of masks, classes as one and mean of the classes."""
    detector = open_detector(DetectSettings(model=str(model), score=LOW_SCORE))
    seen = look(detector, [p.path for p in test.photos if p.path]).found
    boxes = evaluate_detections(as_dataset(test, seen, CLASSES, masks=False), plain_boxes(test))
    masks = evaluate_detections(as_dataset(test, seen, CLASSES, masks=True), test)
    return {
        "boxes": boxes.boxes["all"].ap50,
        "masks": masks.masks["all"].ap50,
        "masks, mean of classes": masks.masks["mean"].ap50,
    }


def compared(gym: str, dataset: Dataset, count: int, folder: Path, minutes: float) -> Any:
    """Return one row: AP50 before and after training, on the photos outside the training."""
    out = folder / f"{gym}-{count}"
    kept = out / "figures.json"
    if not kept.is_file():
        train, test = parted(dataset, count)
        row = {
            "gym": gym,
            "photos": count,
            "objects": sum(len(p.annotations) for p in train.photos),
            "rest": len(test.photos),
            "before": figures(shipped_model(), test),
            "after": figures(fine_tune(train, out, minutes), test),
        }
        write_json(kept, row)
    return read_json(kept)


def labelled(photos: tuple[Photo, ...]) -> tuple[Photo, ...]:
    """Return the photos with a picture and labels."""
    return tuple(p for p in photos if p.annotations and p.path is not None)


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("-o", "--out", type=Path, default=Path("fine-tune"))
    parser.add_argument("--minutes", type=float, default=2.0)
    parser.add_argument("--photos", type=int, nargs="+", default=[2, 4, 8])
    parser.add_argument("--gyms", nargs="+", choices=GYMS, default=list(GYMS))
    args = parser.parse_args()
    console = Console(width=120)
    names = ("boxes", "masks", "masks, mean of classes")
    console.print(f"AP50 before -> after {args.minutes:g} min on so many photos\n")
    console.print(f"| gym | photos (objects) | tested on | {' | '.join(names)} |")
    console.print(f"|---|---|---|{'---|' * len(names)}")
    for gym in args.gyms:
        dataset = GYMS[gym](args.data)
        dataset = Dataset(labelled(dataset.photos), CLASSES)
        for count in args.photos:
            row = compared(gym, dataset, count, args.out, args.minutes)
            cells = " | ".join(f"{row['before'][n]:.3f} -> {row['after'][n]:.3f}" for n in names)
            cell = f"{row['photos']} ({row['objects']})"
            console.print(f"| {gym} | {cell} | {row['rest']} | {cells} |", markup=False)


if __name__ == "__main__":
    main()

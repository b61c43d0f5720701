"""Photos that a gym needs for fine-tuning: the shipped network trained on 2, 4, 8 of them.

    python -m benchmarks.fine_tune [DATA] [-o FOLDER] [--minutes 2] [--photos 2 4 8]

DATA is the folder of the test data (default ../shared/data). Per gym and number of photos: the
training of `walltopo train gym` runs for `--minutes` on evenly drawn photos, then AP50 of masks
before and after is measured on the other photos (of gym-a on twelve of them). The networks stay in
FOLDER, because both gyms are for reporting only. gym-a's labels are the true mesh drawn into the
photos. hold-masks has nine photos in all, so eight training photos leave one. Figures already in
FOLDER are kept.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from msgspec import to_builtins
from rich.console import Console

from walltopo.core import Camera, Silent, View
from walltopo.core.files import read_json, write_json
from walltopo.segment.detect.detector import shipped_model
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.train.own_network import CLASSES, compare_network, fine_tune

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


def row_of(gym: str, dataset: Dataset, count: int, folder: Path, minutes: float) -> Any:
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
            "before": to_builtins(compare_network(shipped_model(), test)),
            "after": to_builtins(
                compare_network(fine_tune(train, out / "run", minutes, Silent()), test)
            ),
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
    names = ("masks", "mean")
    console.print(f"AP50 before -> after {args.minutes:g} min on so many photos\n")
    console.print("| gym | photos (objects) | tested on | masks | masks, mean of classes |")
    console.print(f"|---|---|---|{'---|' * len(names)}")
    for gym in args.gyms:
        dataset = GYMS[gym](args.data)
        dataset = Dataset(labelled(dataset.photos), CLASSES)
        for count in args.photos:
            row = row_of(gym, dataset, count, args.out, args.minutes)
            cells = " | ".join(f"{row['before'][n]:.3f} -> {row['after'][n]:.3f}" for n in names)
            cell = f"{row['photos']} ({row['objects']})"
            console.print(f"| {gym} | {cell} | {row['rest']} | {cells} |", markup=False)


if __name__ == "__main__":
    main()

"""How often, how large and how mirrored a photo should be looked at: measured on held-out photos.

    python -m walltopo_lab.benchmarks.detector_looks [DATA] [--model FILE] [--looks 1280 1600 1600+960m ...]

DATA is the folder of the test data (default ../shared/data). The photos are those of
hold-boxes/train that `walltopo train` holds out; they choose, the figures to quote come from
`python -m walltopo_lab.benchmarks.detectors`. `1600+960m` means: at 1600 px and, mirrored, at 960 px. CPU
seconds are of one photo at its looks, with decoding, on one thread.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from walltopo.core import InputError
from walltopo.detect.augmented import fuse, mirrored
from walltopo.detect.contract import DetectSettings
from walltopo.detect.detector import shipped_model
from walltopo.detect.found import Found
from walltopo.detect.onnx_detector import OnnxDetector
from walltopo.detect.stage import photos_in
from walltopo.imaging.photo_file import read_rgb
from walltopo_lab.benchmarks.detectors import LOW_SCORE
from walltopo_lab.train.batches import split_sources
from walltopo_lab.train.cache import read_yolo_boxes
from walltopo_lab.train.choose import Truth, ap_of
from walltopo_lab.train.params import TrainSettings

LOOKS = ("1280", "1600", "1280+1280m", "1600+800m", "1600+960m", "1600+1280m", "1600+1280m+960m")


def held_out(folder: Path) -> list[Path]:
    """Photos that training keeps for choosing."""
    photos = {path.name: path for path in photos_in(folder / "images")}
    _, names = split_sources(sorted(photos), TrainSettings.held_out)
    return [photos[name] for name in names]


def truth_of(photo: Path, width: int, height: int) -> Truth:
    """Labels beside a photo of a YOLO folder."""
    path = photo.parent.parent / "labels" / f"{photo.stem}.txt"
    classes, boxes = read_yolo_boxes(path, width, height)
    return Truth(boxes, classes + 1)


def look(model: Path, what: str, photos: list[Path]) -> tuple[list[Found], float]:
    """Detections of one look, such as `960m`, and CPU-seconds a photo."""
    try:
        size = int(what.removesuffix("m"))
    except ValueError as error:
        raise InputError(f"--looks: expected such as 1600 or 960m, got {what!r}") from error
    settings = DetectSettings(size=size, again=0.0, score=LOW_SCORE / 3, threads=1)
    detector = OnnxDetector(model, settings)
    found, seconds = [], []
    for path in photos:
        photo = read_rgb(path)
        begin = time.process_time()
        if what.endswith("m"):
            found.append(mirrored(detector.detect(np.ascontiguousarray(photo[:, ::-1]))))
        else:
            found.append(detector.detect(photo))
        seconds.append(time.process_time() - begin)
    return found, float(np.mean(seconds[1:]))


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--model", type=Path, default=shipped_model())
    parser.add_argument("--looks", nargs="+", default=LOOKS)
    args = parser.parse_args()
    photos = held_out(args.data / "hold-boxes" / "train")
    truth = [truth_of(p, *read_rgb(p).shape[1::-1]) for p in photos]
    single = {
        what: look(args.model, what, photos)
        for what in sorted({part for text in args.looks for part in text.split("+")})
    }
    table = Table("looks", "AP50", "hold", "volume", "AP75", "CPU-s", title=f"{len(photos)} photos")
    for text in args.looks:
        parts = [single[what] for what in text.split("+")]
        fused = [fuse(found) for found in zip(*(found for found, _ in parts), strict=True)]
        fused = [f.pick(np.flatnonzero(f.scores >= LOW_SCORE)) for f in fused]
        figures = (
            ap_of(fused, truth),
            ap_of(fused, truth, label=1),
            ap_of(fused, truth, label=2),
            ap_of(fused, truth, iou=0.75),
        )
        seconds = sum(cpu for _, cpu in parts)
        table.add_row(text, *(f"{value:.3f}" for value in figures), f"{seconds:.2f}")
    Console(width=100).print(table)


if __name__ == "__main__":
    main()

"""Draw the worst cases of a detector on photos outside its training.

    python -m benchmarks.worst [DATA] [--sets valid,masks] [--model NAME|FILE] [-o DIR]

The output is the number of labelled objects without a matching detection (IoU under .3 at the
thresholds in use), by class and by common properties. DIR gets two sheets. `missed.png` shows the
largest missed objects in their photo. `false.png` shows the detections of highest score that match
no label. Each sheet has at most two of a photo.
"""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw

from benchmarks.detectors import SETS, boxes_of
from walltopo.images.files import read_rgb
from walltopo.segment.detect.detector import open_detector
from walltopo.segment.detect.photo_detections import box_iou
from walltopo.segment.settings import DetectSettings
from walltopo_lab.datasets.read import read_dataset

MET, FREE = 0.3, 0.1  # IoU from which an object is seen; IoU below which a detection is false
SHOWN, COLUMNS, SIDE, TITLE = 24, 6, 260, 14
A_PHOTO = 2
DARK = 60  # mean of 255


@dataclass(frozen=True, eq=False)
class Case:
    """One labelled object, or one detection that matches none.

    Parameters
    ----------
    photo : the picture; box : x0, y0, x1, y1 in its pixels; label : 1 hold, 2 volume.
    rank : sort key; the largest is the worst.
    seen : whether a detection matches it; cut : whether the photo's edge cuts it.
    carries : number of other objects with their middle in its box; brightness : mean, 0 to 255.
    """

    photo: Path
    box: NDArray[np.float64]
    label: int
    rank: float
    seen: bool = False
    cut: bool = False
    carries: int = 0
    brightness: float = 0.0


def cases_of(path: Path, settings: DetectSettings) -> tuple[list[Case], list[Case]]:
    """Return all labelled objects of a set, and the detections that match none of them."""
    detector = open_detector(settings)
    objects: list[Case] = []
    false: list[Case] = []
    for photo in read_dataset(path).photos:
        if photo.path is None or not photo.annotations:
            continue
        picture = read_rgb(photo.path)
        found, boxes = detector.detect(picture), boxes_of(photo)
        overlap = box_iou(found.boxes, boxes)
        best = overlap.max(axis=0, initial=0)
        middles = (boxes[:, :2] + boxes[:, 2:]) / 2
        for box, annotation, met in zip(boxes, photo.annotations, best, strict=True):
            inside = ((middles > box[:2]) & (middles < box[2:])).all(axis=1)
            x0, y0, x1, y1 = box.astype(int)
            objects.append(
                Case(
                    photo.path,
                    box,
                    annotation.label,
                    float(np.sqrt(np.prod(box[2:] - box[:2])) / max(picture.shape[:2])),
                    seen=bool(met >= MET),
                    cut=bool(
                        (box[:2] < 2).any() or (box[2:] > np.array(picture.shape[1::-1]) - 2).any()
                    ),
                    carries=int(inside.sum()) - 1,
                    brightness=float(picture[max(y0, 0) : y1 + 1, max(x0, 0) : x1 + 1].mean()),
                )
            )
        for k in np.flatnonzero(overlap.max(axis=1, initial=0) < FREE):
            score = float(found.scores[k])
            false.append(Case(photo.path, found.boxes[k], int(found.labels[k]), score))
    return objects, false


def table(objects: Sequence[Case]) -> Iterator[str]:
    """Yield the table of missed objects of each kind, line by line."""
    kinds: dict[str, Callable[[Case], bool]] = {
        "all": lambda case: True,
        "cut by the photo's edge": lambda case: case.cut,
        "with another object on it": lambda case: case.carries > 0,
        f"darker than {DARK} of 255": lambda case: case.brightness < DARK,
        "the others": lambda case: not case.cut and not case.carries and case.brightness >= DARK,
    }
    yield "| | holds | missed | volumes | missed |"
    yield "|---|---|---|---|---|"
    for name, belongs in kinds.items():
        cells = []
        for label in (1, 2):
            own = [case for case in objects if case.label == label and belongs(case)]
            missed = sum(not case.seen for case in own)
            cells += [str(len(own)), f"{missed} ({missed / max(len(own), 1):.2f})"]
        yield f"| {name} | {' | '.join(cells)} |"


def sheet(cases: Sequence[Case]) -> Image.Image:
    """Return a sheet of the worst cases, each with its surroundings."""
    taken: Counter[Path] = Counter()
    shown: list[Case] = []
    for case in sorted(cases, key=lambda case: -case.rank):
        taken[case.photo] += 1
        if taken[case.photo] <= A_PHOTO and len(shown) < SHOWN:
            shown.append(case)
    lines = -(-len(shown) // COLUMNS)
    page = Image.new("RGB", (COLUMNS * SIDE, lines * (SIDE + TITLE)))
    pen = ImageDraw.Draw(page)
    for number, case in enumerate(shown):
        x, y = number % COLUMNS * SIDE, number // COLUMNS * (SIDE + TITLE)
        kind = "hold" if case.label == 1 else "volume"
        pen.text((x + 2, y + 1), f"{number} {kind} {case.rank:.2f} {case.photo.name[:20]}")
        page.paste(_around(case), (x, y + TITLE))
    return page


def _around(case: Case) -> Image.Image:
    half = 1.2 * max(*(case.box[2:] - case.box[:2]), 40)
    corner = (case.box[:2] + case.box[2:]) / 2 - half
    x, y = corner.astype(int).tolist()
    size = int(2 * half)
    photo = Image.fromarray(read_rgb(case.photo))
    part = photo.crop((x, y, x + size, y + size)).resize((SIDE, SIDE))
    drawn = (case.box - np.tile(corner, 2)) * (SIDE / (2 * half))
    ImageDraw.Draw(part).rectangle(drawn.tolist(), outline=(255, 0, 255), width=2)
    return part


def main() -> None:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    parser.add_argument("--model", default="onnx")
    parser.add_argument("--sets", default="valid,masks")
    parser.add_argument("-o", "--output", type=Path)
    args = parser.parse_args()
    for name in args.sets.split(","):
        objects, false = cases_of(args.data / SETS[name], DetectSettings(model=args.model))
        print(f"{name}:\n", *table(objects), f"\n{len(false)} detections meet nothing\n", sep="\n")
        if args.output:
            folder = args.output / name
            folder.mkdir(parents=True, exist_ok=True)
            sheet([case for case in objects if not case.seen]).save(folder / "missed.png")
            sheet(false).save(folder / "false.png")


if __name__ == "__main__":
    main()

"""How well `walltopo dataset check` finds labels that sit turned against their picture.

    python -m walltopo_lab.benchmarks.label_turns [DATA]

Prints, for hold-boxes/train (on which the margin was chosen) and hold-boxes/valid: photos judged,
photos reported as they were published, and the share found of labels turned on purpose.
"""

from __future__ import annotations

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from walltopo_lab.datasets.check import TURNS, check_dataset, turned_boxes
from walltopo_lab.datasets.model import Dataset, Photo
from walltopo_lab.datasets.read import read_dataset


def turned(photo: Photo, turn: str) -> Photo:
    """The photo with its labels turned."""
    size = np.array([photo.width, photo.height] * 2)
    corners = turned_boxes(photo, turn) * size
    rows = tuple(
        replace(a, box=(float(b[0]), float(b[1]), float(b[2] - b[0]), float(b[3] - b[1])))
        for a, b in zip(photo.annotations, corners, strict=True)
    )
    return photo.with_annotations(rows)


def reported(dataset: Dataset) -> int:
    """Photos whose labels are said to be turned."""
    return sum(finding.kind == "turned" for finding in check_dataset(dataset))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("data", type=Path, nargs="?", default=Path("../shared/data"))
    args = parser.parse_args()
    for part, step in (("train", 4), ("valid", 2)):
        whole = read_dataset(args.data / "hold-boxes" / part)
        print(f"{part}: {len(whole.photos)} photos, {reported(whole)} reported as published")
        many = tuple(p for p in whole.photos[::step] if len(p.annotations) >= 15)
        for turn in ("turned by 180°", "turned by 90° clockwise", "mirrored left-right"):
            found = reported(Dataset(tuple(turned(p, turn) for p in many), whole.classes))
            print(f"  {turn}: {found} of {len(many)} found")
    print(f"turns tried: {len(TURNS)}")


if __name__ == "__main__":
    main()

"""Conversion of the cached training sets to Ultralytics' format: images/, labels/, data.yaml."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core.files import atomic_path
from walltopo_lab.train.cache import Sample, open_cache
from walltopo_lab.train.sets import LabelledSet

_CLASSES = ("hold", "volume")


def _object_outline(sample: Sample, k: int, exact: bool) -> NDArray[np.float64]:
    """Return the (n, 2) outline of an object in pixels.

    Ultralytics derives an object's box from its outline. A pseudo-mask may be
    undecided at its rim, so its hull, stretched to the box, is used; an exact mask gives the
    outline.
    """
    if exact:
        x0, y0, x1, y1 = (int(v) for v in np.round(sample.boxes[k]))
        mine = (np.asarray(sample.ids[y0:y1, x0:x1]) == k + 1).astype(np.uint8)
        shapes, _ = cv2.findContours(mine, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        largest = max(shapes, key=cv2.contourArea, default=None)
        if largest is not None and len(largest) >= 3:
            return np.asarray(largest[:, 0, :] + [x0 + 0.5, y0 + 0.5], dtype=np.float64)
    return sample.hulls[k].astype(np.float64)


def label_lines(sample: Sample, exact: bool, segments: bool) -> list[str]:
    """Return the lines of a photo's label file: class and relative box or outline per object."""
    height, width = sample.image.shape[:2]
    lines = []
    for k, label in enumerate(sample.labels):
        if segments:
            values = np.clip(_object_outline(sample, k, exact) / [width, height], 0, 1).ravel()
        else:
            x0, y0, x1, y1 = np.clip(sample.boxes[k], 0, [width, height, width, height])
            values = np.array([(x0 + x1) / 2, (y0 + y1) / 2, x1 - x0, y1 - y0])
            values = values / [width, height, width, height]
        lines.append(" ".join([str(int(label) - 1), *(f"{v:.5f}" for v in values)]))
    return lines


def _photos(sets: Sequence[LabelledSet], part: str) -> Iterator[tuple[LabelledSet, str]]:
    for item in sets:
        for name in item.train if part == "train" else item.held_out:
            yield item, name


def write_yolo_set(sets: Sequence[LabelledSet], folder: Path, segments: bool) -> Path:
    """Write all photos of the sets with their split; return the path of `data.yaml`.

    Without held-out photos, validation uses the training photos, which `open_sets` reports.
    """
    for part in ("train", "val"):
        for kind in ("images", "labels"):
            (folder / kind / part).mkdir(parents=True, exist_ok=True)
        for item, name in _photos(sets, part):
            stem = f"{item.name}-{name}"
            picture = folder / "images" / part / f"{stem}.png"
            sample = open_cache(item.folder, name)
            if not picture.is_file():
                with atomic_path(picture) as temporary:
                    cv2.imwrite(str(temporary), np.asarray(sample.image))
            lines = label_lines(sample, item.exact, segments)
            (folder / "labels" / part / f"{stem}.txt").write_text("\n".join(lines) + "\n")
    checked = "val" if any(item.held_out for item in sets) else "train"
    names = "\n".join(f"  {k}: {name}" for k, name in enumerate(_CLASSES))
    path = folder / "data.yaml"
    path.write_text(
        f"path: {folder.resolve()}\ntrain: images/train\nval: images/{checked}\nnames:\n{names}\n",
        encoding="utf-8",
    )
    return path

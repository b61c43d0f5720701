"""YOLO text labels: one line per object, boxes or outlines, relative to the photo's size."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import atomic_path, join_inside
from walltopo.core.text_files import read_text
from walltopo.images.files import open_picture
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.shapes import box_of_polygons, join_outlines, polygons_of

PHOTO_SUFFIXES = (".jpg", ".jpeg", ".png", ".webp", ".bmp")
_PHOTO_FOLDERS = ("images", "photos")


def photo_size(path: Path) -> tuple[int, int]:
    """Return width and height of a photo as stored (without EXIF rotation).

    Raises
    ------
    InputError : the file is no image.
    """
    with prefix_errors(path), open_picture(path) as image:
        return image.size


def read_names(path: Path, text: str) -> dict[int, str]:
    """Return the `names` in the text of a data.yaml: a list or a mapping, inline or in lines.

    Only this key is parsed, so that no YAML library is needed.
    """
    match = re.search(r"^names:[ \t]*(.*(?:\n[ \t-].*)*)", text, re.MULTILINE)
    if match is None:
        raise InputError(f"{path}: has no `names`")
    body = match.group(1)
    pairs = re.findall(r"(\d+)\s*:\s*(\"[^\"]*\"|'[^']*'|[^,}\n]+)", body)
    if pairs:
        if any(len(k) > 6 for k, _ in pairs):
            raise InputError(f"{path}: `names` has a class beyond a million")
        return {int(k): v.strip().strip("'\"") for k, v in pairs}
    inline = re.match(r"\s*\[(.*)\]", body, re.DOTALL)
    items = inline.group(1).split(",") if inline else re.findall(r"-\s*(.+)", body)
    return {k: item.strip().strip("'\"") for k, item in enumerate(items) if item.strip()}


def _folders(root: Path) -> tuple[Path, Path]:
    for name in _PHOTO_FOLDERS:
        if (root / name).is_dir() and (root / "labels").is_dir():
            return root / name, root / "labels"
    raise InputError(
        f"{root}: not a YOLO set", "Expected a folder `labels` beside `images` or `photos`."
    )


def read_yolo(root: Path) -> Dataset:
    """Read a folder with `images` (or `photos`) and `labels`.

    Class ids grow by one, because 0 means "none" here. Names come from the data.yaml in the
    folder or the one above it. A photo without a label file was not labelled and is left out; an
    empty label file means that the photo has no objects. Where data.yaml says `kpt_shape`, lines
    are boxes with key points, which are counted in `not_read`.

    Raises
    ------
    InputError : a line is no box and no outline; the message names file and line.
    """
    photos, labels = _folders(root)
    places = (root / "data.yaml", root.parent / "data.yaml")
    yaml = next((place for place in places if place.is_file()), None)
    about = read_text(yaml) if yaml else ""
    names = {k + 1: v for k, v in read_names(yaml, about).items()} if yaml else {}
    poses = re.search(r"^kpt_shape:", about, re.MULTILINE) is not None
    not_read: Counter[str] = Counter()
    result: list[Photo] = []
    for path in sorted(photos.rglob("*")):
        text = labels / path.relative_to(photos).with_suffix(".txt")
        if path.suffix.lower() not in PHOTO_SUFFIXES or not text.is_file():
            continue
        width, height = photo_size(path)
        rows = _read_lines(text, width, height, not_read if poses else None)
        with prefix_errors(text):
            result.append(Photo(path.relative_to(photos).as_posix(), width, height, rows, path))
    used = {a.label for photo in result for a in photo.annotations}
    classes = names | {label: f"class {label}" for label in sorted(used - set(names))}
    return Dataset(tuple(result), classes, not_read)


def _read_lines(
    path: Path, width: int, height: int, poses: Counter[str] | None
) -> tuple[Annotation, ...]:
    """Return the objects of a file; `poses` counts the key points that follow each box."""
    rows: list[Annotation] = []
    for number, line in enumerate(read_text(path).splitlines(), start=1):
        if not line.strip():
            continue
        try:
            first, *values = line.split()
            label, shares = int(float(first)) + 1, np.array([float(v) for v in values])
            if poses is not None and len(shares) > 4:
                poses["keypoints"] += 1
                shares = shares[:4]
            rows.append(_annotation(label, shares, width, height))
        except (ValueError, OverflowError, InputError) as error:
            raise InputError(f"{path}:{number}: neither box nor outline ({error})") from error
    return tuple(rows)


def _annotation(
    label: int, shares: np.ndarray[tuple[int], np.dtype[np.float64]], width: int, height: int
) -> Annotation:
    # Four numbers are a box, five a box with score, more an outline (an odd number: with score).
    score = float(shares[-1]) if len(shares) % 2 else 1.0
    shares = shares[: len(shares) // 2 * 2]
    points = shares.reshape(-1, 2) * np.array([width, height])
    if len(points) == 2:
        (cx, cy), (w, h) = points
        return Annotation(label, (cx - w / 2, cy - h / 2, w, h), score=score)
    if len(points) < 3:
        raise InputError(f"{len(shares) + 1} numbers")
    return Annotation(label, box_of_polygons([points]), (points,), score=score)


def write_yolo(root: Path, dataset: Dataset, *, segments: bool) -> None:
    """Write `labels/*.txt` and `data.yaml`; class ids count from 0 in the order of our ids.

    Parameters
    ----------
    segments : outlines instead of boxes. A box-only object becomes its box's four corners; parts
        of one object are joined by bridges of zero width, because a line holds one outline; a mask
        without pixels is left out.
    """
    index = {label: k for k, label in enumerate(sorted(dataset.classes))}
    for photo in dataset.photos:
        shown = [a for a in photo.annotations if not segments or polygons_of(a, photo)]
        lines = [_line(a, photo, index, segments) for a in shown]
        with atomic_path(join_inside(root / "labels", photo.name).with_suffix(".txt")) as temporary:
            temporary.write_text("".join(f"{line}\n" for line in lines), encoding="utf-8")
    names = "".join(f"  {k}: {dataset.classes[label]}\n" for label, k in index.items())
    with atomic_path(root / "data.yaml") as temporary:
        temporary.write_text(f"train: images\nval: images\nnames:\n{names}", encoding="utf-8")


def _line(annotation: Annotation, photo: Photo, index: Mapping[int, int], segments: bool) -> str:
    size = np.array([photo.width, photo.height], dtype=np.float64)
    if segments:
        outline = join_outlines(polygons_of(annotation, photo))
        values = (np.clip(outline, 0, size) / size).ravel()
    else:
        x, y, w, h = annotation.box
        values = (np.array([[x + w / 2, y + h / 2], [w, h]]) / size).ravel()
    return " ".join([str(index[annotation.label]), *(f"{v:.6f}" for v in values)])

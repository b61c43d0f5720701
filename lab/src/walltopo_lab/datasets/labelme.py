"""LabelMe: one JSON per photo, the picture embedded or linked."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError
from walltopo.core.files import read_json, write_json
from walltopo.imaging.opening import open_picture
from walltopo_lab.datasets.model import Annotation, Dataset, Photo, Polygon
from walltopo_lab.datasets.shapes import box_of_polygons, ellipse, polygons_of, rectangle

__all__ = ["embedded_photo", "is_labelme", "read_labelme", "write_labelme"]

VERSION = "5.5.0"


def is_labelme(data: Any) -> bool:
    """Whether parsed JSON has the keys of LabelMe."""
    return isinstance(data, dict) and {"shapes", "imagePath"} <= set(data)


def embedded_photo(data: Mapping[str, Any], path: Path) -> bytes | None:
    """The picture inside a LabelMe file, as the bytes of its own file; None where it is linked."""
    encoded = data.get("imageData")
    if not encoded:
        return None
    try:
        return base64.b64decode(encoded, validate=True)
    except (binascii.Error, ValueError) as error:
        raise InputError(f"{path}: imageData is not base64 ({error})") from error


def read_labelme(folder: Path) -> Dataset:
    """Read every LabelMe JSON of a folder (or one file).

    Class ids follow the names in alphabetical order. Shapes: polygon, rectangle, circle; lines
    and points say nothing about an area and are left out. Shapes of one label and `group_id` are
    parts of one object.

    Raises
    ------
    InputError : a file is broken; names it.
    """
    files = [folder] if folder.is_file() else sorted(folder.rglob("*.json"))
    documents = [(path, read_json(path)) for path in files]
    documents = [(path, data) for path, data in documents if is_labelme(data)]
    if not documents:
        raise InputError(f"{folder}: no LabelMe files here")
    names = sorted({str(shape["label"]) for _, data in documents for shape in data["shapes"]})
    labels = {name: k for k, name in enumerate(names, start=1)}
    photos = tuple(_photo(path, data, labels) for path, data in documents)
    return Dataset(photos, {label: name for name, label in labels.items()})


def _photo(path: Path, data: Mapping[str, Any], labels: Mapping[str, int]) -> Photo:
    # LabelMe writes Windows paths on Windows.
    linked = path.parent / str(data["imagePath"]).replace("\\", "/")
    try:
        width, height = _size(path, data, linked)
        parts: dict[Any, list[Polygon]] = {}
        for number, shape in enumerate(data["shapes"]):
            polygon = _polygon(shape)
            if polygon is not None:
                group = shape.get("group_id")
                key = (shape["label"], number if group is None else f"group {group}")
                parts.setdefault(key, []).append(polygon)
    except (KeyError, TypeError, ValueError, IndexError) as error:
        raise InputError(f"{path}: broken LabelMe file: {error!r}") from error
    rows = tuple(
        Annotation(labels[name], box_of_polygons(polygons), tuple(polygons))
        for (name, _), polygons in parts.items()
    )
    found = linked if linked.is_file() else None
    inside = None if found else embedded_photo(data, path)
    return Photo(linked.name, width, height, rows, found, embedded=inside)


def _size(path: Path, data: Mapping[str, Any], linked: Path) -> tuple[int, int]:
    from walltopo_lab.datasets.yolo import photo_size

    if data.get("imageWidth") and data.get("imageHeight"):
        return int(data["imageWidth"]), int(data["imageHeight"])
    inside = embedded_photo(data, path)
    if inside is None:
        return photo_size(linked)
    try:
        with open_picture(inside) as image:
            return image.size
    except InputError as error:
        raise InputError(f"{path}: its picture: {error.message}") from error


def _polygon(shape: Mapping[str, Any]) -> Polygon | None:
    kind = shape.get("shape_type", "polygon")
    points = np.asarray(shape["points"], dtype=np.float64).reshape(-1, 2)
    if kind == "rectangle":
        low, high = points.min(axis=0), points.max(axis=0)
        return rectangle(*low, *(high - low))
    if kind == "circle":  # centre and a point on the rim
        radius = float(np.linalg.norm(points[1] - points[0]))
        return ellipse(points[0, 0], points[0, 1], radius, radius)
    return points if kind == "polygon" and len(points) >= 3 else None


def write_labelme(root: Path, dataset: Dataset, *, embed: bool = False) -> None:
    """Write one JSON per photo.

    Parameters
    ----------
    embed : put the picture into the file (needs `Photo.path`).
    """
    for photo in dataset.photos:
        shapes: list[dict[str, Any]] = []
        for group, annotation in enumerate(photo.annotations):
            polygons = polygons_of(annotation, photo)
            for polygon in polygons:
                box = not annotation.has_shape
                points = polygon[[0, 2]] if box else polygon
                shapes.append(
                    {
                        "label": dataset.classes[annotation.label],
                        "points": points.tolist(),
                        "group_id": group if len(polygons) > 1 else None,
                        "shape_type": "rectangle" if box else "polygon",
                        "flags": {},
                    }
                )
        inside = None
        if embed:
            inside = base64.b64encode(photo.content()).decode("ascii")
        document: dict[str, Any] = {
            "version": VERSION,
            "flags": {},
            "shapes": shapes,
            "imagePath": photo.name,
        }
        document |= {"imageData": inside}
        document |= {"imageHeight": photo.height, "imageWidth": photo.width}
        write_json((root / photo.name).with_suffix(".json"), document)

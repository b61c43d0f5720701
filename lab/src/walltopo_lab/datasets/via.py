"""Reading and writing of VGG Image Annotator (VIA 2): one JSON for a folder of photos."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from walltopo.core import InputError
from walltopo.core.errors import prefix_errors
from walltopo.core.files import read_json, write_json
from walltopo.scans.document import parse
from walltopo_lab.datasets.coco import find_photo
from walltopo_lab.datasets.model import Annotation, Dataset, Photo, Polygon
from walltopo_lab.datasets.shapes import box_of_polygons, ellipse, polygons_of
from walltopo_lab.datasets.yolo import photo_size

# Common attribute names of the class, in order of preference; otherwise the only attribute.
_CLASS_KEYS = ("class", "label", "type", "name", "category")
_ATTRIBUTE = "class"


class _Rect(msgspec.Struct, frozen=True, tag_field="name", tag="rect"):
    x: float
    y: float
    width: float
    height: float


class _Circle(msgspec.Struct, frozen=True, tag_field="name", tag="circle"):
    cx: float
    cy: float
    r: float


class _Ellipse(msgspec.Struct, frozen=True, tag_field="name", tag="ellipse"):
    cx: float
    cy: float
    rx: float
    ry: float


class _Outline(msgspec.Struct, frozen=True, tag_field="name", tag="polygon"):
    all_points_x: tuple[float, ...]
    all_points_y: tuple[float, ...]


class _Line(msgspec.Struct, frozen=True, tag_field="name", tag="polyline"):
    """A polyline, which encloses no area."""


class _Point(msgspec.Struct, frozen=True, tag_field="name", tag="point"):
    """A point, which encloses no area."""


_Shape = _Rect | _Circle | _Ellipse | _Outline | _Line | _Point


class _Region(msgspec.Struct, frozen=True):
    shape: _Shape = msgspec.field(name="shape_attributes")
    attributes: dict[str, Any] = msgspec.field(name="region_attributes", default={})


class _File(msgspec.Struct, frozen=True):
    filename: str
    regions: tuple[_Region, ...] | dict[str, _Region]  # a list since VIA 2, a mapping before

    @property
    def all_regions(self) -> tuple[_Region, ...]:
        """Return the regions, whether a list or a mapping has them."""
        regions = self.regions
        return tuple(regions.values()) if isinstance(regions, dict) else regions


def _files(data: Any) -> Any:
    return data.get("_via_img_metadata", data) if isinstance(data, dict) else None


def is_via(data: Any) -> bool:
    """Return whether parsed JSON is a VIA project or a VIA export of annotations."""
    files = _files(data)
    return (
        isinstance(files, dict)
        and bool(files)
        and all(isinstance(v, dict) and "regions" in v for v in files.values())
    )


def read_via(path: Path, photos: Path | None = None) -> Dataset:
    """Read a VIA JSON; the photos must be available, because VIA does not store their size.

    Raises
    ------
    InputError : a photo is missing, or a region is invalid; the message names it.
    """
    data = read_json(path)
    if not is_via(data):
        raise InputError(f"{path}: not a VIA file")
    files = list(parse(_files(data), dict[str, _File], str(path)).values())
    places = [photos] if photos else []
    places += [path.parent, path.parent / "images", path.parent / "photos"]
    names = sorted({_class_name(region) for file in files for region in file.all_regions})
    labels = {name: k for k, name in enumerate(names, start=1)}
    not_read: Counter[str] = Counter()
    with prefix_errors(path):
        found = [_photo(file, labels, places, not_read) for file in files]
        return Dataset(tuple(found), {label: name for name, label in labels.items()}, not_read)


def _photo(
    file: _File, labels: Mapping[str, int], places: Sequence[Path], not_read: Counter[str]
) -> Photo:
    """Return a photo and its objects; count the shapes that are left out."""
    picture = find_photo(file.filename, places)
    if picture is None:
        raise InputError(
            f"{file.filename} is not in {', '.join(str(p) for p in places)}",
            "VIA does not note sizes; give the folder of photos with --photos.",
        )
    rows: list[Annotation] = []
    for number, region in enumerate(file.all_regions):
        with prefix_errors(f"{file.filename}: region {number}"):
            row = _annotation(region.shape, labels[_class_name(region)])
        if row is None:
            not_read[str(region.shape.__struct_config__.tag)] += 1
        else:
            rows.append(row)
    return Photo(file.filename, *photo_size(picture), tuple(rows), picture)


def _class_name(region: _Region) -> str:
    attributes = region.attributes
    key = next((k for k in _CLASS_KEYS if k in attributes), next(iter(attributes), None))
    if key is None:
        return "hold"
    value = attributes[key]
    # A check box attribute maps the chosen names to true.
    return next(iter(value), "hold") if isinstance(value, dict) else str(value)


def _annotation(shape: _Shape, label: int) -> Annotation | None:
    if isinstance(shape, _Rect):
        return Annotation(label, (shape.x, shape.y, shape.width, shape.height))
    polygon = _polygon(shape)
    if polygon is None:
        return None
    return Annotation(label, box_of_polygons([polygon]), (polygon,))


def _polygon(shape: _Shape) -> Polygon | None:
    if isinstance(shape, _Outline):
        if len(shape.all_points_x) != len(shape.all_points_y):
            raise InputError("all_points_x and all_points_y are of different lengths")
        points = np.array([shape.all_points_x, shape.all_points_y], dtype=np.float64).T
        return points if len(points) >= 3 else None
    if isinstance(shape, _Circle):
        return ellipse(shape.cx, shape.cy, shape.r, shape.r)
    if isinstance(shape, _Ellipse):
        return ellipse(shape.cx, shape.cy, shape.rx, shape.ry)
    return None


def write_via(path: Path, dataset: Dataset) -> None:
    """Write a VIA annotation file; each part of an object becomes a separate region."""
    files: dict[str, Any] = {}
    for photo in dataset.photos:
        size = photo.path.stat().st_size if photo.path else -1
        regions: list[dict[str, Any]] = []
        for annotation in photo.annotations:
            attributes = {_ATTRIBUTE: dataset.classes[annotation.label]}
            for shape in _shapes(annotation, photo):
                regions.append({"shape_attributes": shape, "region_attributes": attributes})
        entry = {"filename": photo.name, "size": size, "regions": regions, "file_attributes": {}}
        files[f"{photo.name}{size}"] = entry
    write_json(path, files)


def _shapes(annotation: Annotation, photo: Photo) -> list[dict[str, Any]]:
    if not annotation.has_shape:
        x, y, w, h = annotation.box
        return [{"name": "rect", "x": x, "y": y, "width": w, "height": h}]
    return [
        {"name": "polygon", "all_points_x": p[:, 0].tolist(), "all_points_y": p[:, 1].tolist()}
        for p in polygons_of(annotation, photo)
    ]

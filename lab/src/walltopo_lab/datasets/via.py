"""VGG Image Annotator (VIA 2): one JSON for a folder of photos."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError
from walltopo.core.files import read_json, write_json
from walltopo_lab.datasets.coco import find_photo
from walltopo_lab.datasets.model import Annotation, Dataset, Photo, Polygon
from walltopo_lab.datasets.shapes import box_of_polygons, ellipse, polygons_of
from walltopo_lab.datasets.yolo import photo_size

__all__ = ["is_via", "read_via", "write_via"]

# Attribute names that people use for the class, in this order; else the only attribute there is.
_CLASS_KEYS = ("class", "label", "type", "name", "category")
_ATTRIBUTE = "class"


def _files(data: Any) -> Any:
    return data.get("_via_img_metadata", data) if isinstance(data, dict) else None


def is_via(data: Any) -> bool:
    """Whether parsed JSON is a VIA project or a VIA export of annotations."""
    files = _files(data)
    return (
        isinstance(files, dict)
        and bool(files)
        and all(isinstance(v, dict) and "regions" in v for v in files.values())
    )


def read_via(path: Path, photos: Path | None = None) -> Dataset:
    """Read a VIA JSON; the photos must be at hand, because VIA does not note their size.

    Raises
    ------
    InputError : a photo is missing, or a region is broken; names which.
    """
    data = read_json(path)
    if not is_via(data):
        raise InputError(f"{path}: not a VIA file")
    files = list(_files(data).values())
    places = [photos] if photos else []
    places += [path.parent, path.parent / "images", path.parent / "photos"]
    regions = [region for file in files for region in _regions(file)]
    names = sorted({_class_name(region) for region in regions})
    labels = {name: k for k, name in enumerate(names, start=1)}
    result: list[Photo] = []
    for file in files:
        name = str(file["filename"])
        picture = find_photo(name, places)
        if picture is None:
            raise InputError(
                f"{path}: {name} is not in {', '.join(str(p) for p in places)}",
                "VIA does not note sizes; give the folder of photos with --photos.",
            )
        try:
            found = [_annotation(region, labels) for region in _regions(file)]
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: {name}: broken region: {error!r}") from error
        rows = tuple(row for row in found if row is not None)
        result.append(Photo(name, *photo_size(picture), rows, picture))
    return Dataset(tuple(result), {label: name for name, label in labels.items()})


def _regions(file: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    regions = file["regions"]  # a list since VIA 2, a mapping before
    return list(regions.values()) if isinstance(regions, dict) else list(regions)


def _class_name(region: Mapping[str, Any]) -> str:
    attributes = region.get("region_attributes", {})
    key = next((k for k in _CLASS_KEYS if k in attributes), next(iter(attributes), None))
    if key is None:
        return "hold"
    value = attributes[key]
    # Check boxes are a mapping of chosen names to true.
    return next(iter(value), "hold") if isinstance(value, dict) else str(value)


def _annotation(region: Mapping[str, Any], labels: Mapping[str, int]) -> Annotation | None:
    shape = region["shape_attributes"]
    label = labels[_class_name(region)]
    if shape["name"] == "rect":
        box = tuple(float(shape[key]) for key in ("x", "y", "width", "height"))
        return Annotation(label, (box[0], box[1], box[2], box[3]))
    polygon = _polygon(shape)
    if polygon is None:
        return None
    return Annotation(label, box_of_polygons([polygon]), (polygon,))


def _polygon(shape: Mapping[str, Any]) -> Polygon | None:
    kind = shape["name"]
    if kind in ("polygon", "polyline"):
        points = np.stack([shape["all_points_x"], shape["all_points_y"]], axis=1).astype(float)
        return points if len(points) >= 3 and kind == "polygon" else None
    if kind == "circle":
        return ellipse(shape["cx"], shape["cy"], shape["r"], shape["r"])
    if kind == "ellipse":
        return ellipse(shape["cx"], shape["cy"], shape["rx"], shape["ry"])
    return None  # points


def write_via(path: Path, dataset: Dataset) -> None:
    """Write a VIA annotation file; parts of one object become regions of their own."""
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

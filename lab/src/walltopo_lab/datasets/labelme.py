"""Reading and writing of LabelMe: one JSON per photo, with the photo embedded or linked."""

from __future__ import annotations

import base64
import binascii
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import msgspec
import numpy as np

from walltopo.core import InputError
from walltopo.core.errors import naming
from walltopo.core.files import join_inside, read_json, write_json
from walltopo.images.files import open_picture
from walltopo.scans.document import parse
from walltopo_lab.datasets.model import Annotation, Dataset, Photo, Polygon
from walltopo_lab.datasets.shapes import box_of_polygons, ellipse, polygons_of, rectangle

VERSION = "5.5.0"


def is_labelme(data: Any) -> bool:
    """Return whether parsed JSON has the keys of LabelMe."""
    return isinstance(data, dict) and {"shapes", "imagePath"} <= set(data)


class _Shape(msgspec.Struct, frozen=True):
    label: str
    points: tuple[tuple[float, float], ...]
    group_id: int | str | None = None
    shape_type: str | None = "polygon"


class _File(msgspec.Struct, frozen=True):
    shapes: tuple[_Shape, ...]
    picture: str = msgspec.field(name="imagePath")
    data: str | None = msgspec.field(name="imageData", default=None)
    width: Annotated[int, msgspec.Meta(ge=0)] | None = msgspec.field(
        name="imageWidth", default=None
    )
    height: Annotated[int, msgspec.Meta(ge=0)] | None = msgspec.field(
        name="imageHeight", default=None
    )


def embedded_photo(data: str | None, path: Path) -> bytes | None:
    """Return the file content of a photo embedded in a LabelMe file; None for a linked photo."""
    if not data:
        return None
    try:
        return base64.b64decode(data, validate=True)
    except (binascii.Error, ValueError) as error:
        raise InputError(f"{path}: imageData is not base64 ({error})") from error


def read_labelme(folder: Path) -> Dataset:
    """Read every LabelMe JSON of a folder (or one file).

    Class ids follow the names in alphabetical order. Shapes: polygon, rectangle, circle; lines
    and points enclose no area and are left out. Shapes of one label and `group_id` are
    parts of one object.

    Raises
    ------
    InputError : a file is invalid; the message names it.
    """
    files = [folder] if folder.is_file() else sorted(folder.rglob("*.json"))
    found = [(path, read_json(path)) for path in files]
    documents = [(path, parse(data, _File, str(path))) for path, data in found if is_labelme(data)]
    if not documents:
        raise InputError(f"{folder}: no LabelMe files here")
    names = sorted({shape.label for _, file in documents for shape in file.shapes})
    labels = {name: k for k, name in enumerate(names, start=1)}
    photos: list[Photo] = []
    for path, file in documents:
        with naming(path):
            photos.append(_photo(path, file, labels))
    with naming(folder):
        return Dataset(tuple(photos), {label: name for name, label in labels.items()})


def _photo(path: Path, file: _File, labels: Mapping[str, int]) -> Photo:
    linked = _linked(path, file.picture)
    inside = None if linked.is_file() else embedded_photo(file.data, path)
    parts: dict[tuple[str, int | str], list[Polygon]] = {}
    for number, shape in enumerate(file.shapes):
        with naming(f"shape {number}"):
            polygon = _polygon(shape)
        if polygon is not None:
            key = number if shape.group_id is None else f"group {shape.group_id}"
            parts.setdefault((shape.label, key), []).append(polygon)
    rows = tuple(
        Annotation(labels[name], box_of_polygons(polygons), tuple(polygons))
        for (name, _), polygons in parts.items()
    )
    found = linked if linked.is_file() else None
    if file.width and file.height:
        return Photo(linked.name, file.width, file.height, rows, found, embedded=inside)
    with naming(linked.name), open_picture(linked if inside is None else inside) as image:
        return Photo(linked.name, *image.size, rows, found, embedded=inside)


def _linked(path: Path, picture: str) -> Path:
    """Return the path of a file's photo, or the path at which the photo is expected.

    LabelMe stores the path from the JSON to the photo, which contains `..` where the
    two lie in separate folders. For such a path only the file name is used, and searched
    in the usual photo folders near the labels.
    """
    way = PurePosixPath(picture.replace("\\", "/"))  # LabelMe writes Windows paths on Windows
    if not way.is_absolute() and ".." not in way.parts:
        return join_inside(path.parent, way.as_posix())
    near = (path.parent, path.parent / "images", path.parent.parent / "images")
    places = [join_inside(place, way.name) for place in (*near, path.parent.parent / "photos")]
    return next((place for place in places if place.is_file()), places[0])


def _polygon(shape: _Shape) -> Polygon | None:
    points = np.asarray(shape.points, dtype=np.float64).reshape(-1, 2)
    if shape.shape_type in ("rectangle", "circle") and len(points) < 2:
        raise InputError(f"a {shape.shape_type} of {len(points)} points")
    if shape.shape_type == "rectangle":
        low, high = points.min(axis=0), points.max(axis=0)
        return rectangle(*low, *(high - low))
    if shape.shape_type == "circle":  # centre and a point on the rim
        radius = float(np.linalg.norm(points[1] - points[0]))
        return ellipse(points[0, 0], points[0, 1], radius, radius)
    return points if shape.shape_type in ("polygon", None) and len(points) >= 3 else None


def write_labelme(root: Path, dataset: Dataset, *, embed: bool = False) -> None:
    """Write one JSON per photo.

    Parameters
    ----------
    embed : embed the photo in the file (needs `Photo.path`).
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
        write_json(join_inside(root, photo.name).with_suffix(".json"), document)

"""Reading and writing of LabelMe: one JSON per photo, with the photo embedded or linked."""

from __future__ import annotations

import base64
import binascii
from collections import Counter
from collections.abc import Mapping
from pathlib import Path, PurePosixPath
from typing import Annotated, Any

import msgspec
import numpy as np

from walltopo.core import InputError, Mask
from walltopo.core.errors import prefix_errors
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
    mask: str | None = None


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

    Class ids follow the names in alphabetical order. Shapes: polygon, rectangle, circle, mask;
    lines and points enclose no area and are counted in `not_read`, as are unknown shapes. Shapes
    of one label and `group_id` are parts of one object; a mask is an object of its own.

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
    not_read: Counter[str] = Counter()
    for path, file in documents:
        with prefix_errors(path):
            photos.append(_photo(path, file, labels, not_read))
    with prefix_errors(folder):
        return Dataset(tuple(photos), {label: name for name, label in labels.items()}, not_read)


def _photo(path: Path, file: _File, labels: Mapping[str, int], not_read: Counter[str]) -> Photo:
    """Return a photo and its objects; count the shapes that are left out."""
    linked = _photo_path(path, file.picture)
    inside = None if linked.is_file() else embedded_photo(file.data, path)
    if file.width and file.height:
        size = (file.width, file.height)
    else:
        with (
            prefix_errors(linked.name),
            open_picture(linked if inside is None else inside) as image,
        ):
            size = image.size
    parts: dict[tuple[str, int | str], list[Polygon]] = {}
    masks: list[Annotation] = []
    for number, shape in enumerate(file.shapes):
        with prefix_errors(f"shape {number}"):
            polygon = _polygon(shape)
            if shape.shape_type == "mask":
                masks.append(_object_of_mask(shape, labels[shape.label], *size))
                continue
        if polygon is None:
            not_read[shape.shape_type or "polygon"] += 1
        else:
            key = number if shape.group_id is None else f"group {shape.group_id}"
            parts.setdefault((shape.label, key), []).append(polygon)
    rows = tuple(
        Annotation(labels[name], box_of_polygons(polygons), tuple(polygons))
        for (name, _), polygons in parts.items()
    )
    found = linked if linked.is_file() else None
    return Photo(linked.name, *size, (*rows, *masks), found, embedded=inside)


def _object_of_mask(shape: _Shape, label: int, width: int, height: int) -> Annotation:
    """Return the object of a `mask`: a PNG in base64 between two corners, both inside.

    Raises
    ------
    InputError : picture or corners are missing, it is damaged, or it begins outside of the photo.
    """
    content = embedded_photo(shape.mask, Path("mask"))
    if content is None or len(shape.points) != 2:
        raise InputError("a mask without its picture or its two corners")
    with open_picture(content) as picture:
        bitmap = np.asarray(picture.convert("L")) > 0
    (left, top), _ = shape.points
    x, y = round(left), round(top)
    if not (0 <= x < width and 0 <= y < height):
        raise InputError(f"a mask at {x}, {y} begins outside of the photo of {width}x{height}")
    part = bitmap[: height - y, : width - x]
    full = np.pad(part, ((y, height - y - part.shape[0]), (x, width - x - part.shape[1])))
    # The box of the whole mask, so that `check` tells when it leaves the photo.
    left, top, wide, high = map(float, Mask.from_full(bitmap, label).box)
    return Annotation(label, (x + left, y + top, wide, high), mask=Mask.from_full(full, label))


def _photo_path(path: Path, picture: str) -> Path:
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

"""Reading and writing of COCO JSON: polygons, RLE and boxes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from walltopo.core import InputError, Mask
from walltopo.core.errors import prefix_errors
from walltopo.core.files import deeper_than, join_inside, read_json, write_json
from walltopo.scans.document import Label, Side, check_once, parse
from walltopo.scans.segmentation import (
    Rle,
    Segmentation,
    check_outlines,
    decode_segmentation,
    encode_mask,
)
from walltopo_lab.datasets.model import Annotation, Dataset, Photo, Polygon
from walltopo_lab.datasets.shapes import box_of_polygons, polygons_of

_DEEPEST = 32  # limits the recursion when the other keys are written back as JSON
_KNOWN = {"id", "image_id", "category_id", "bbox", "segmentation", "score", "area", "iscrowd"}


def is_coco(data: Any) -> bool:
    """Return whether parsed JSON has the keys of COCO."""
    return isinstance(data, dict) and {"images", "annotations", "categories"} <= set(data)


class _Image(msgspec.Struct, frozen=True):
    id: int | str
    file_name: str
    width: Side
    height: Side
    gym: str | int = ""


class _Category(msgspec.Struct, frozen=True):
    id: Label
    name: str


class _Row(msgspec.Struct, frozen=True):
    image_id: int | str
    category_id: Label
    segmentation: Segmentation | None = None
    bbox: tuple[float, float, float, float] | None = None
    score: float = 1.0
    id: int | str = "?"


class _File(msgspec.Struct, frozen=True):
    """A set of labels; unlike in `detections.json`, shapes are optional."""

    images: tuple[_Image, ...]
    categories: tuple[_Category, ...]
    annotations: tuple[_Row, ...]

    def __post_init__(self) -> None:
        check_once("image id", (image.id for image in self.images))
        check_once("category id", (category.id for category in self.categories))


def find_photo(name: str, folders: Sequence[Path]) -> Path | None:
    """Return the first existing `folder/name`; reject a name that leads out of a folder."""
    paths = [join_inside(folder, name) for folder in folders]
    return next((path for path in paths if path.is_file()), None)


def read_coco(path: Path, photos: Path | None = None) -> Dataset:
    """Read a COCO file.

    Category ids are kept (0 becomes the next free id: 0 means "none" here). Photos are searched
    in `photos`, beside the file, and in `images/` and `photos/` there. Lines and key points without
    a box enclose no area and are counted in `not_read`.

    Raises
    ------
    InputError : not COCO, or an invalid annotation, which the message names.
    """
    data = read_json(path)
    if not is_coco(data):
        raise InputError(f"{path}: not a COCO file (images, annotations, categories)")
    checked = parse(data, _File, str(path))
    places = [photos] if photos else []
    places += [path.parent, path.parent / "images", path.parent / "photos"]
    free = 1 + max([c.id for c in checked.categories], default=0)
    label_of = {c.id: c.id or free for c in checked.categories}
    images = {image.id: image for image in checked.images}
    rows: dict[int | str, list[Annotation]] = {key: [] for key in images}
    not_read: Counter[str] = Counter()
    for row, plain in zip(checked.annotations, data["annotations"], strict=True):
        with prefix_errors(f"{path}: annotation {row.id}"):
            if row.image_id not in images:
                raise InputError(f"there is no image {row.image_id}")
            if row.category_id not in label_of:
                raise InputError(f"there is no category {row.category_id}")
            extra = {key: value for key, value in plain.items() if key not in _KNOWN}
            if deeper_than(_DEEPEST, extra):
                raise InputError("its other keys are nested too deeply")
            label = label_of[row.category_id]
            if kind := _without_area(row, extra):
                not_read[kind] += 1
            else:
                rows[row.image_id].append(_annotation(row, images[row.image_id], label, extra))
    with prefix_errors(path):
        found = [(image, find_photo(image.file_name, places)) for image in checked.images]
        return Dataset(
            tuple(
                Photo(
                    image.file_name,
                    image.width,
                    image.height,
                    tuple(rows[image.id]),
                    picture,
                    str(image.gym),
                )
                for image, picture in found
            ),
            {label_of[c.id]: c.name for c in checked.categories},
            not_read,
        )


def _without_area(row: _Row, extra: dict[str, Any]) -> str | None:
    """Return the kind of an annotation that encloses no area; None if it does."""
    if isinstance(row.segmentation, Rle):
        return None
    if row.segmentation:
        return "line" if all(len(one) in (0, 2, 4) for one in row.segmentation) else None
    return "keypoints" if row.bbox is None and extra.get("keypoints") else None


def _annotation(row: _Row, image: _Image, label: int, extra: dict[str, Any]) -> Annotation:
    polygons: tuple[Polygon, ...] = ()
    mask: Mask | None = None
    if isinstance(row.segmentation, Rle):
        score = min(max(row.score, 1e-6), 1.0)
        mask = decode_segmentation(row.segmentation, image.width, image.height, label, score)
    elif row.segmentation:
        outlines = check_outlines(row.segmentation, image.width, image.height)
        polygons = tuple(np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in outlines)
    if row.bbox is not None:
        box = row.bbox
    elif mask is not None:
        x, y, w, h = mask.box
        box = (float(x), float(y), float(w), float(h))
    elif polygons:
        box = box_of_polygons(polygons)
    else:
        raise InputError("has neither a shape nor a box")
    return Annotation(label, box, polygons, mask, row.score, extra)


def _segmentation_of(annotation: Annotation, photo: Photo, rle: bool) -> tuple[Any, float]:
    """Return COCO's `segmentation` and `area`."""
    from walltopo_lab.datasets.shapes import mask_of

    if not annotation.has_shape:
        return [], annotation.box[2] * annotation.box[3]
    mask = mask_of(annotation, photo)
    if rle:
        return encode_mask(mask), mask.area
    polygons = polygons_of(annotation, photo)
    return [np.round(p, 2).ravel().tolist() for p in polygons], mask.area


def write_coco(path: Path, dataset: Dataset, *, rle: bool = False, scores: bool = False) -> None:
    """Write a COCO file; atomic.

    Parameters
    ----------
    rle : shapes as compressed RLE (exact, with holes) instead of polygons.
    scores : write `score`, as for detections.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for image_id, photo in enumerate(dataset.photos, start=1):
        image: dict[str, Any] = {"id": image_id, "file_name": photo.name}
        image |= {"width": photo.width, "height": photo.height}
        images.append(image | ({"gym": photo.gym} if photo.gym else {}))
        for annotation in photo.annotations:
            segmentation, area = _segmentation_of(annotation, photo, rle)
            row: dict[str, Any] = {
                "id": len(annotations) + 1,
                "image_id": image_id,
                "category_id": annotation.label,
                "bbox": [round(float(v), 3) for v in annotation.box],
                "segmentation": segmentation,
                "area": float(area),
                "iscrowd": 0,
            }
            if scores:
                row["score"] = annotation.score
            annotations.append(row | dict(annotation.extra))
    categories = [{"id": label, "name": name} for label, name in sorted(dataset.classes.items())]
    write_json(path, {"images": images, "categories": categories, "annotations": annotations})

"""COCO JSON: polygons, RLE and boxes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError, Mask
from walltopo.core.files import read_json, write_json
from walltopo.scans.detections import decode_segmentation, encode_mask
from walltopo_lab.datasets.model import Annotation, Dataset, Photo
from walltopo_lab.datasets.shapes import box_of_polygons, polygons_of

__all__ = ["is_coco", "read_coco", "write_coco"]

_KNOWN = {"id", "image_id", "category_id", "bbox", "segmentation", "score", "area", "iscrowd"}


def is_coco(data: Any) -> bool:
    """Whether parsed JSON has the keys of COCO."""
    return isinstance(data, dict) and {"images", "annotations", "categories"} <= set(data)


def find_photo(name: str, folders: Sequence[Path]) -> Path | None:
    """The first of `folder/name` that exists."""
    return next((folder / name for folder in folders if (folder / name).is_file()), None)


def read_coco(path: Path, photos: Path | None = None) -> Dataset:
    """Read a COCO file.

    Category ids are kept (0 becomes the next free id: 0 means "none" here). Pictures are looked
    for in `photos`, beside the file, and in `images/` and `photos/` there.

    Raises
    ------
    InputError : not COCO, or an annotation is broken; names which.
    """
    data = read_json(path)
    if not is_coco(data):
        raise InputError(f"{path}: not a COCO file (images, annotations, categories)")
    places = [photos] if photos else []
    places += [path.parent, path.parent / "images", path.parent / "photos"]
    classes, label_of = _classes(data["categories"])
    images = {image["id"]: image for image in data["images"]}
    rows: dict[Any, list[Annotation]] = {key: [] for key in images}
    for row in data["annotations"]:
        try:
            rows[row["image_id"]].append(_annotation(row, images[row["image_id"]], label_of))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: annotation {row.get('id', '?')}: {error!r}") from error
        except InputError as error:
            raise InputError(f"{path}: annotation {row.get('id', '?')}: {error.message}") from error
    return Dataset(
        tuple(
            Photo(
                str(image["file_name"]),
                int(image["width"]),
                int(image["height"]),
                tuple(rows[key]),
                find_photo(str(image["file_name"]), places),
                str(image.get("gym", "")),
            )
            for key, image in images.items()
        ),
        classes,
    )


def _classes(categories: Sequence[Mapping[str, Any]]) -> tuple[dict[int, str], dict[int, int]]:
    free = 1 + max([int(c["id"]) for c in categories], default=0)
    label_of = {int(c["id"]): int(c["id"]) or free for c in categories}
    return {label_of[int(c["id"])]: str(c["name"]) for c in categories}, label_of


def _annotation(
    row: Mapping[str, Any], image: Mapping[str, Any], label_of: Mapping[int, int]
) -> Annotation:
    label, score = label_of[int(row["category_id"])], float(row.get("score", 1.0))
    segmentation = row.get("segmentation")
    polygons: tuple[Any, ...] = ()
    mask: Mask | None = None
    if isinstance(segmentation, list):
        long_enough = [p for p in segmentation if len(p) >= 6]
        polygons = tuple(np.asarray(p, dtype=np.float64).reshape(-1, 2) for p in long_enough)
    elif segmentation:
        size = int(image["width"]), int(image["height"])
        mask = decode_segmentation(segmentation, *size, label, min(max(score, 1e-6), 1.0))
    if "bbox" in row:
        x, y, w, h = (float(v) for v in row["bbox"])
    elif mask is not None:
        x, y, w, h = (float(v) for v in mask.box)
    else:
        x, y, w, h = box_of_polygons(polygons)
    extra = {key: value for key, value in row.items() if key not in _KNOWN}
    return Annotation(label, (x, y, w, h), polygons, mask, score, extra)


def _segmentation(annotation: Annotation, photo: Photo, rle: bool) -> tuple[Any, float]:
    """COCO's `segmentation` and `area`."""
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
    scores : with `score`, as for detections.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for image_id, photo in enumerate(dataset.photos, start=1):
        image: dict[str, Any] = {"id": image_id, "file_name": photo.name}
        image |= {"width": photo.width, "height": photo.height}
        images.append(image | ({"gym": photo.gym} if photo.gym else {}))
        for annotation in photo.annotations:
            segmentation, area = _segmentation(annotation, photo, rle)
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

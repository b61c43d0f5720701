"""COCO files with RLE masks: `detections.json` to and from `Mask`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError, Mask
from walltopo.scans.folder import read_json, write_json

__all__ = ["decode_segmentation", "encode_mask", "read_coco_masks", "write_coco_masks"]


def encode_mask(mask: Mask) -> dict[str, Any]:
    """COCO's compressed RLE (JSON-able) of a mask at its full image size."""
    from pycocotools import mask as rle

    encoded = rle.encode(np.asfortranarray(mask.full(), dtype=np.uint8))
    height, width = encoded["size"]
    return {"size": [int(height), int(width)], "counts": encoded["counts"].decode("ascii")}


def decode_segmentation(
    segmentation: Any, width: int, height: int, label: int, score: float
) -> Mask:
    """A mask from COCO's polygons, uncompressed RLE or compressed RLE.

    Raises
    ------
    InputError : the segmentation is none of these.
    """
    from pycocotools import mask as rle

    try:
        if isinstance(segmentation, list):
            polygons = [p for p in segmentation if len(p) >= 6]
            encoded = rle.merge(rle.frPyObjects(polygons, height, width)) if polygons else None
        elif isinstance(segmentation["counts"], list):
            encoded = rle.frPyObjects(segmentation, *segmentation["size"])
        else:
            encoded = segmentation
        if encoded is None:
            return Mask(np.zeros((0, 0), dtype=np.bool_), 0, 0, width, height, label, score)
        bitmap = np.asarray(rle.decode(encoded)).astype(np.bool_)
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"segmentation is neither polygons nor RLE: {error}") from error
    return Mask.from_full(bitmap, label, score)


def read_coco_masks(path: Path) -> tuple[dict[str, tuple[Mask, ...]], dict[int, str]]:
    """Masks by photo name, and class names by label, of a COCO file.

    The order of a photo's masks is the order of its annotations in the file. Labels are COCO's
    category ids. Annotations without `score` count as certain (1.0).

    Raises
    ------
    InputError : the file is missing, is not COCO, or an annotation is broken; names which.
    """
    data = read_json(path)
    try:
        images = {image["id"]: image for image in data["images"]}
        classes = {int(c["id"]): str(c["name"]) for c in data["categories"]}
        annotations = data["annotations"]
    except (KeyError, TypeError) as error:
        raise InputError(f"{path}: not a COCO file, {error} is missing") from error
    masks: dict[str, list[Mask]] = {image["file_name"]: [] for image in images.values()}
    for annotation in annotations:
        number = annotation.get("id", "?")
        try:
            image = images[annotation["image_id"]]
            mask = decode_segmentation(
                annotation["segmentation"],
                int(image["width"]),
                int(image["height"]),
                int(annotation["category_id"]),
                float(annotation.get("score", 1.0)),
            )
        except KeyError as error:
            raise InputError(f"{path}: annotation {number}: {error} is missing") from error
        except InputError as error:
            raise InputError(f"{path}: annotation {number}: {error.message}") from error
        masks[image["file_name"]].append(mask)
    return {name: tuple(items) for name, items in masks.items()}, classes


def write_coco_masks(
    path: Path,
    masks: Mapping[str, Sequence[Mask]],
    sizes: Mapping[str, tuple[int, int]],
    classes: Mapping[int, str],
    info: Mapping[str, Any] | None = None,
) -> None:
    """Write masks as COCO with compressed RLE, `bbox`, `area` and `score`; atomic.

    Parameters
    ----------
    masks : photo name to its masks.
    sizes : photo name to (width, height); every photo of the set, also those without a mask.
    classes : label to class name.
    info : COCO's `info` block.
    """
    images: list[dict[str, Any]] = []
    annotations: list[dict[str, Any]] = []
    for image_id, (name, (width, height)) in enumerate(sizes.items(), start=1):
        images.append({"id": image_id, "file_name": name, "width": width, "height": height})
        for mask in masks.get(name, ()):
            annotations.append(
                {
                    "id": len(annotations) + 1,
                    "image_id": image_id,
                    "category_id": mask.label,
                    "segmentation": encode_mask(mask),
                    "bbox": [float(v) for v in mask.box],
                    "area": mask.area,
                    "iscrowd": 0,
                    "score": round(float(mask.score), 4),
                }
            )
    categories = [{"id": label, "name": name} for label, name in sorted(classes.items())]
    data: dict[str, Any] = {"info": dict(info or {})}
    data |= {"images": images, "categories": categories, "annotations": annotations}
    write_json(path, data)

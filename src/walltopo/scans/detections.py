"""`detections.json`: masks of objects in photos, as COCO with RLE."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from walltopo.core import InputError, Mask
from walltopo.core.files import write_json
from walltopo.scans.document import read_document

__all__ = ["CocoFile", "Detections", "decode_segmentation", "encode_mask", "read_coco_masks"]


@dataclass(frozen=True)
class Detections:
    """What a detector found in each photo.

    Parameters
    ----------
    masks : photo name to its masks, in the order of the file; photos without any are there too.
    sizes : photo name to (width, height).
    classes : class name by label.
    description : of what found them.
    """

    masks: Mapping[str, tuple[Mask, ...]]
    sizes: Mapping[str, tuple[int, int]]
    classes: Mapping[int, str]
    description: str = ""

    @classmethod
    def load(cls, path: Path) -> Detections:
        """Read a COCO file. Labels are COCO's category ids; without `score` a mask is certain.

        Raises
        ------
        InputError : the file is missing, is not COCO, or an annotation is broken; names which.
        """
        data = read_document(path, CocoFile)
        images = {image.id: image for image in data.images}
        masks: dict[str, list[Mask]] = {image.file_name: [] for image in data.images}
        for row in data.annotations:
            where = f"{path}: annotation {row.id}"
            if row.image_id not in images:
                raise InputError(f"{where}: there is no image {row.image_id}")
            image = images[row.image_id]
            try:
                mask = decode_segmentation(
                    row.segmentation, image.width, image.height, row.category_id, row.score
                )
            except InputError as error:
                raise InputError(f"{where}: {error.message}") from error
            masks[image.file_name].append(mask)
        return cls(
            {name: tuple(items) for name, items in masks.items()},
            {image.file_name: (image.width, image.height) for image in data.images},
            {category.id: category.name for category in data.categories},
            str(data.info.get("description", "")),
        )

    def save(self, path: Path) -> None:
        """Write COCO with compressed RLE, `bbox`, `area` and `score`; atomic."""
        images: list[dict[str, Any]] = []
        rows: list[dict[str, Any]] = []
        for number, (name, (width, height)) in enumerate(self.sizes.items(), start=1):
            images.append({"id": number, "file_name": name, "width": width, "height": height})
            for mask in self.masks.get(name, ()):
                rows.append(_annotation(mask, len(rows) + 1, number))
        categories = [{"id": label, "name": name} for label, name in sorted(self.classes.items())]
        info = {"description": self.description} if self.description else {}
        write_json(
            path,
            {"info": info, "images": images, "categories": categories, "annotations": rows},
        )


class CocoImage(msgspec.Struct, frozen=True):
    id: int
    file_name: str
    width: int
    height: int


class CocoCategory(msgspec.Struct, frozen=True):
    id: int
    name: str


class CocoAnnotation(msgspec.Struct, frozen=True):
    image_id: int
    category_id: int
    segmentation: Any  # polygons or RLE: `decode_segmentation` tells them apart
    score: float = 1.0
    id: int | str = "?"


class CocoFile(msgspec.Struct, frozen=True):
    """What is read of a COCO file; other keys are passed over."""

    images: tuple[CocoImage, ...]
    categories: tuple[CocoCategory, ...]
    annotations: tuple[CocoAnnotation, ...]
    info: dict[str, Any] = {}


def _annotation(mask: Mask, number: int, image: int) -> dict[str, Any]:
    return {
        "id": number,
        "image_id": image,
        "category_id": mask.label,
        "segmentation": encode_mask(mask),
        "bbox": [float(v) for v in mask.box],
        "area": mask.area,
        "iscrowd": 0,
        "score": max(round(float(mask.score), 4), 1e-4),  # 0 is no score
    }


def encode_mask(mask: Mask) -> dict[str, Any]:
    """COCO's compressed RLE (JSON-able) of a mask at its full image size."""
    from faster_coco_eval.core import mask as rle

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
    from faster_coco_eval.core import mask as rle

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
    except (KeyError, RuntimeError, TypeError, ValueError) as error:
        raise InputError(f"segmentation is neither polygons nor RLE: {error}") from error
    return Mask.from_full(bitmap, label, score)


def read_coco_masks(path: Path) -> tuple[dict[str, tuple[Mask, ...]], dict[int, str]]:
    """Masks by photo name, and class names by label, of a COCO file; see `Detections.load`."""
    found = Detections.load(Path(path))
    return dict(found.masks), dict(found.classes)

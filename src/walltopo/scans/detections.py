"""`detections.json`: masks of objects in photos, as COCO with RLE."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import msgspec

from walltopo.core import InputError, Mask
from walltopo.core.errors import prefix_errors
from walltopo.core.files import write_json
from walltopo.core.view import check_picture_size
from walltopo.scans.document import Label, Side, check_once, read_document
from walltopo.scans.segmentation import Segmentation, decode_segmentation, encode_mask

CocoId = Annotated[int, msgspec.Meta(ge=-(2**63), le=2**63 - 1)]
MIN_BUDGET = 1 << 30
PIXELS_PER_BYTE = 256


@dataclass(frozen=True)
class Detections:
    """The detections in each photo.

    Parameters
    ----------
    masks : photo name to masks, in the order of the file; photos without masks are included.
    sizes : photo name to (width, height).
    classes : class name by label.
    description : of the detector.
    """

    masks: Mapping[str, tuple[Mask, ...]]
    sizes: Mapping[str, tuple[int, int]]
    classes: Mapping[int, str]
    description: str = ""

    @classmethod
    def load(cls, path: Path) -> Detections:
        """Return a COCO file's content. Labels are category ids; the default `score` is 1.

        Raises
        ------
        InputError : the file is missing or not COCO, or an annotation is invalid (it is named).
        """
        return cls.from_coco(read_document(path, CocoFile), path)

    @classmethod
    def from_coco(cls, data: CocoFile, path: Path) -> Detections:
        """Return the content of a COCO file; `path` names it in errors (see `load`)."""
        images = {image.id: image for image in data.images}
        budget = MaskBudget(path)
        masks: dict[str, list[Mask]] = {image.file_name: [] for image in data.images}
        for row in data.annotations:
            where = f"{path}: annotation {row.id}"
            image = images[row.image_id]
            with prefix_errors(where):
                mask = decode_segmentation(
                    row.segmentation, image.width, image.height, row.category_id, row.score
                )
                budget.spend(mask)
            masks[image.file_name].append(mask)
        return cls(
            {name: tuple(items) for name, items in masks.items()},
            {image.file_name: (image.width, image.height) for image in data.images},
            {category.id: category.name for category in data.categories},
            str(data.info.get("description", "")),
        )

    def save(self, path: Path) -> None:
        """Write COCO with compressed RLE, `bbox`, `area` and `score`, atomically."""
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
    id: CocoId
    file_name: str
    width: Side
    height: Side

    def __post_init__(self) -> None:
        check_picture_size(self.width, self.height)


class CocoCategory(msgspec.Struct, frozen=True):
    id: Label
    name: str


class CocoAnnotation(msgspec.Struct, frozen=True):
    image_id: CocoId
    category_id: Label
    segmentation: Segmentation
    score: float = 1.0
    id: CocoId | str = "?"


class CocoFile(msgspec.Struct, frozen=True):
    """The keys of a COCO file that are read; others are ignored."""

    images: tuple[CocoImage, ...]
    categories: tuple[CocoCategory, ...]
    annotations: tuple[CocoAnnotation, ...]
    info: dict[str, Any] = {}

    def __post_init__(self) -> None:
        check_once("image id", (image.id for image in self.images))
        check_once("photo", (image.file_name for image in self.images))
        check_once("category id", (category.id for category in self.categories))
        images = {image.id for image in self.images}
        categories = {category.id for category in self.categories}
        for row in self.annotations:
            if row.image_id not in images:
                raise InputError(f"annotation {row.id}: image {row.image_id} does not exist")
            if row.category_id not in categories:
                message = f"annotation {row.id}: category {row.category_id} does not exist"
                raise InputError(message)


class MaskBudget:
    """A limit on the total number of mask pixels of a file.

    A mask of a whole picture is a few bytes in a file and up to 250 MB in memory. Masks of holds
    have 10 to 80 pixels per byte.
    """

    def __init__(self, path: Path) -> None:
        self.max_pixels = max(MIN_BUDGET, PIXELS_PER_BYTE * path.stat().st_size)
        self.used = 0

    def spend(self, mask: Mask) -> None:
        """Count a mask; raise InputError if the limit is exceeded."""
        self.used += mask.bitmap.size
        if self.used > self.max_pixels:
            raise InputError(
                f"the masks up to here need more than {self.max_pixels >> 20} MB of memory",
                "Masks of holds are small; check that the file does not mask whole photos.",
            )


def _annotation(mask: Mask, number: int, image: int) -> dict[str, Any]:
    return {
        "id": number,
        "image_id": image,
        "category_id": mask.label,
        "segmentation": encode_mask(mask),
        "bbox": [float(v) for v in mask.box],
        "area": mask.area,
        "iscrowd": 0,
        "score": max(round(float(mask.score), 4), 1e-4),  # a score must not be 0
    }

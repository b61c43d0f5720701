"""The data model of a set of labelled photos, independent of its file format."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask
from walltopo.core.errors import prefix_errors
from walltopo.core.files import check_name
from walltopo.core.view import check_picture_size
from walltopo.images.files import open_picture
from walltopo.scans.segmentation import check_outlines

# (n, 2) float, pixels; pixel (0, 0) is the corner of the top-left pixel.
Polygon = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Annotation:
    """One labelled object in a photo.

    Parameters
    ----------
    label : class id, >= 1.
    box : x, y, w, h in pixels (COCO's bbox); may leave the photo, which `check` reports.
    polygons : outlines of its parts, or empty.
    mask : its bitmap, or None. A box-only annotation has neither.
    score : confidence; 1 for manual labels.
    extra : all other keys of its file (`route_id` and the like), JSON-serialisable.
    """

    label: int
    box: tuple[float, float, float, float]
    polygons: tuple[Polygon, ...] = ()
    mask: Mask | None = None
    score: float = 1.0
    extra: Mapping[str, Any] = field(default_factory=dict[str, Any])

    def __post_init__(self) -> None:
        if not 1 <= self.label < 2**31:
            raise InputError(f"annotation label: expected >= 1, got {self.label}")
        if not np.isfinite(self.box).all():
            raise InputError(f"annotation box: expected finite numbers, got {self.box}")
        if not np.isfinite(self.score):
            raise InputError(f"annotation score: expected a finite number, got {self.score}")

    @property
    def has_shape(self) -> bool:
        """Return whether the object has a mask or polygons, and not only a box."""
        return self.mask is not None or bool(self.polygons)


@dataclass(frozen=True, eq=False)
class Photo:
    """One photo and its labels.

    Parameters
    ----------
    name : file name relative to the folder of photos, always inside it.
    width, height : pixels.
    annotations : in the order of the file.
    path : the photo's file; None if it was not found.
    gym : gym of the photo; '' if the file does not name it.
    embedded : content of a photo that is embedded in the label file.
    """

    name: str
    width: int
    height: int
    annotations: tuple[Annotation, ...] = ()
    path: Path | None = None
    gym: str = ""
    embedded: bytes | None = None

    def __post_init__(self) -> None:
        check_name(self.name)
        with prefix_errors(self.name):
            check_picture_size(self.width, self.height)
            for number, annotation in enumerate(self.annotations):
                with prefix_errors(f"object {number}"):
                    check_outlines([p.ravel() for p in annotation.polygons], *self.size)
                    self._check_box(annotation.box)

    @property
    def size(self) -> tuple[int, int]:
        """Return width and height in pixels."""
        return self.width, self.height

    def _check_box(self, box: tuple[float, float, float, float]) -> None:
        size = np.array(self.size * 2)
        corners = np.array([box[0], box[1], box[0] + box[2], box[1] + box[3]])
        if not (np.abs(corners) <= 10 * size).all():  # `check` reports smaller faults
            raise InputError(f"box {box} is far outside the picture of {self.width}x{self.height}")

    def content(self) -> bytes:
        """Return the bytes of the photo's file.

        Raises
        ------
        InputError : the photo was not found.
        """
        if self.path is not None:
            return self.path.read_bytes()
        if self.embedded is None:
            raise InputError(
                f"{self.name}: the picture was not found beside its labels",
                "Give the folder of photos with --photos.",
            )
        return self.embedded

    def pixels(self) -> NDArray[np.uint8]:
        """Return (height, width, 3) sRGB as stored, without EXIF rotation; labels refer to it.

        Raises
        ------
        InputError : the photo was not found, is no image, or differs in size from the labels.
        """
        with prefix_errors(self.name), open_picture(self.content()) as image:
            self._compare_size(image.size)
            return np.asarray(image.convert("RGB"))

    def check_size(self) -> None:
        """Open the photo's file, without decoding it.

        Raises
        ------
        InputError : the photo was not found, is no image, or differs in size from the labels.
        """
        with prefix_errors(self.name), open_picture(self.path or self.content()) as image:
            self._compare_size(image.size)

    def _compare_size(self, found: tuple[int, int]) -> None:
        if found != self.size:
            width, height = found
            raise InputError(
                f"the picture is {width}x{height}, its labels say {self.width}x{self.height}"
            )

    def with_annotations(self, annotations: tuple[Annotation, ...]) -> Photo:
        """Return the same photo with other labels."""
        return replace(self, annotations=annotations)


@dataclass(frozen=True, eq=False)
class Dataset:
    """A set of photos with labels.

    Parameters
    ----------
    photos : the photos, with unique names.
    classes : class id (>= 1) to name.
    not_read : kind of shape to the number of shapes that were left out, because they enclose no
        area or are not understood.

    Raises
    ------
    InputError : a photo occurs twice, a class has no name, or every shape was left out.
    """

    photos: tuple[Photo, ...]
    classes: Mapping[int, str]
    not_read: Mapping[str, int] = field(default_factory=dict[str, int])

    def __post_init__(self) -> None:
        if self.not_read and not any(photo.annotations for photo in self.photos):
            raise InputError(
                f"none of its shapes is understood: {self.describe_not_read()}",
                "Draw polygons, rectangles, circles or masks.",
            )
        names = [photo.name for photo in self.photos]
        if len(set(names)) != len(names):
            (twice, _), *_ = Counter(names).most_common(1)
            raise InputError(f"photo {twice} occurs twice in the set")
        used = {a.label for photo in self.photos for a in photo.annotations}
        stray = sorted(used - set(self.classes))
        if stray:
            raise InputError(f"annotations of classes without a name: {stray[:5]}")

    def describe_not_read(self) -> str:
        """Return the number of shapes left out of each kind, in words."""
        return ", ".join(f"{number} of {kind!r}" for kind, number in sorted(self.not_read.items()))

    def subset(self, names: set[str]) -> Dataset:
        """Return the set with only the photos of these names."""
        return Dataset(tuple(p for p in self.photos if p.name in names), self.classes)

    def reclassed(self, named: Mapping[str, Collection[str]]) -> Dataset:
        """Return the set with other classes: each new name replaces some of the old ones.

        Parameters
        ----------
        named : new name to old names, in the order of the new class ids; "*" among the old
            names stands for all that no other entry lists. Unlisted classes are left out.

        Raises
        ------
        InputError : an old name is unknown to the set or listed twice.
        """
        taken = [name for names in named.values() for name in names if name != "*"]
        known = set(self.classes.values())
        for name in taken:
            if name not in known:
                class_names = ", ".join(sorted(known))
                raise InputError(f"the set has no class {name!r}", f"It has: {class_names}.")
            if taken.count(name) > 1:
                raise InputError(f"class {name!r} cannot become two classes")
        number = {
            old: new
            for new, names in enumerate(named.values(), start=1)
            for old in (known - set(taken) if "*" in names else set()) | set(names)
        }

        def changed(annotation: Annotation) -> Annotation | None:
            label = number.get(self.classes[annotation.label])
            return replace(annotation, label=label) if label else None

        photos = tuple(
            p.with_annotations(tuple(a for a in map(changed, p.annotations) if a))
            for p in self.photos
        )
        return Dataset(photos, dict(enumerate(named, start=1)))

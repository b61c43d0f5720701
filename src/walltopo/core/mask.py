"""A 2D mask: one object in one photo, stored as the bitmap of its bounding box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core.errors import InputError


@dataclass(frozen=True, eq=False)
class Mask:
    """One detected object in a photo.

    Parameters
    ----------
    bitmap : (h, w) bool, the mask within its bounding box.
    x, y : column and row of the bitmap's top-left pixel in the photo.
    width, height : size in pixels of the image the mask was drawn in; it may differ from the
        photo's size (then the mask is scaled when used).
    label : class id, >= 1 (0 means none).
    score : confidence in (0, 1].

    Examples
    --------
    >>> import numpy as np
    >>> image = np.zeros((480, 640), dtype=np.bool_)
    >>> image[100:110, 200:220] = True
    >>> mask = Mask.from_full(image, label=1, score=0.9)
    >>> mask.box, mask.area
    ((200, 100, 20, 10), 200)
    """

    bitmap: NDArray[np.bool_]
    x: int
    y: int
    width: int
    height: int
    label: int
    score: float

    def __post_init__(self) -> None:
        if self.bitmap.ndim != 2 or self.bitmap.dtype != np.bool_:
            raise InputError(
                f"mask bitmap: expected (h, w) bool, got {self.bitmap.shape} {self.bitmap.dtype}"
            )
        h, w = self.bitmap.shape
        if self.x < 0 or self.y < 0 or self.x + w > self.width or self.y + h > self.height:
            raise InputError(
                f"mask of {w}x{h} at ({self.x}, {self.y}) leaves its image of "
                f"{self.width}x{self.height}"
            )
        if self.label < 1:
            raise InputError(f"mask label: expected >= 1, got {self.label}")
        if not 0.0 < self.score <= 1.0:
            raise InputError(f"mask score: expected in (0, 1], got {self.score}")

    @classmethod
    def from_full(cls, bitmap: NDArray[np.bool_], label: int, score: float = 1.0) -> Mask:
        """Crop a full-size (H, W) bool bitmap to its bounding box (an empty one stays 0x0)."""
        height, width = bitmap.shape
        rows, cols = np.flatnonzero(bitmap.any(axis=1)), np.flatnonzero(bitmap.any(axis=0))
        if len(rows) == 0:
            return cls(np.zeros((0, 0), dtype=np.bool_), 0, 0, width, height, label, score)
        y0, y1, x0, x1 = rows[0], rows[-1] + 1, cols[0], cols[-1] + 1
        crop = np.ascontiguousarray(bitmap[y0:y1, x0:x1]).astype(np.bool_)
        return cls(crop, int(x0), int(y0), width, height, label, score)

    def full(self) -> NDArray[np.bool_]:
        """The mask as an (height, width) bool image."""
        image = np.zeros((self.height, self.width), dtype=np.bool_)
        h, w = self.bitmap.shape
        image[self.y : self.y + h, self.x : self.x + w] = self.bitmap
        return image

    @property
    def area(self) -> int:
        """Number of pixels set."""
        return int(np.count_nonzero(self.bitmap))

    @property
    def box(self) -> tuple[int, int, int, int]:
        """x, y, w, h in pixels (COCO's bbox)."""
        h, w = self.bitmap.shape
        return self.x, self.y, w, h


MOST_SIDE = 65_535  # what a JPEG can have

# More than any phone's sensor (200 million) and than the largest texture (16384 px squared) have.
MOST_PIXELS = 280_000_000


def check_picture_size(width: int, height: int) -> None:
    """Refuse sizes that no picture of a phone has: arrays are made of such numbers.

    Raises
    ------
    InputError : a side is not positive, or the picture is beyond `MOST_SIDE` or `MOST_PIXELS`.
    """
    if width <= 0 or height <= 0:
        raise InputError(f"picture size must be positive, got {width}x{height}")
    if max(width, height) > MOST_SIDE or width * height > MOST_PIXELS:
        raise InputError(
            f"a picture of {width}x{height} is too large; "
            f"at most {MOST_SIDE} a side and {MOST_PIXELS // 10**6} megapixels"
        )

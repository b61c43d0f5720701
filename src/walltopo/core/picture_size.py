"""How large a picture may be that a data file tells of."""

from __future__ import annotations

from walltopo.core.errors import InputError

__all__ = ["MOST_PIXELS", "MOST_SIDE", "check_picture_size"]

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

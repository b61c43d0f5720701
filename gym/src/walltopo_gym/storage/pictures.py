"""Pictures that people send: upright, smaller, and re-encoded from their pixels alone.

One is decoded at a time, because a small file can be a large picture.
"""

from __future__ import annotations

import threading
import warnings
from dataclasses import dataclass
from io import BytesIO
from typing import TYPE_CHECKING, Final, Literal

from walltopo_gym.errors import RequestError, TooManyError

if TYPE_CHECKING:
    from PIL import Image


_FORMATS: Final = ("JPEG", "PNG", "WEBP")
_MAX_PIXELS: Final = 25_000_000
_QUALITY: Final = 80  # of a JPEG
_PATIENCE_S: Final = 5.0
_SOON_S: Final = 60
DECODING: Final = threading.Lock()


@dataclass(frozen=True)
class Picture:
    """A file of a picture and its size in pixels."""

    content: bytes
    width: int
    height: int


def encode_picture(content: bytes, longest: int, kind: Literal["JPEG", "PNG"]) -> Picture:
    """Return a sent picture as a new file without metadata.

    Parameters
    ----------
    longest : pixels of the longer side; a larger picture is reduced.

    Raises
    ------
    RequestError : the format is not supported, or it is too large. TooManyError : others are being
        decoded.
    """
    if not DECODING.acquire(timeout=_PATIENCE_S):
        raise TooManyError("pictures-busy", _SOON_S)
    try:
        upright = _decode_picture(content, longest)
        out = BytesIO()
        upright.save(out, kind, optimize=True, quality=_QUALITY)
    finally:
        DECODING.release()
    return Picture(out.getvalue(), upright.width, upright.height)


def _decode_picture(content: bytes, longest: int) -> Image.Image:
    """Return the picture upright, at most `longest` across."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(BytesIO(content), formats=_FORMATS) as image:
                if image.width * image.height > _MAX_PIXELS:
                    raise RequestError(
                        "picture-too-large",
                        "picture-smaller",
                        width=image.width,
                        height=image.height,
                        megapixels=_MAX_PIXELS // 1000000,
                    )
                upright = ImageOps.exif_transpose(image).convert("RGB")
    except (
        UnidentifiedImageError,
        Image.DecompressionBombError,
        Image.DecompressionBombWarning,
        OSError,
        ValueError,
        SyntaxError,
    ) as error:
        raise RequestError("picture-not-one", "picture-send") from error
    upright.thumbnail((longest, longest))
    # `convert` and `thumbnail` keep the file's own notes, among them the place of the photo.
    upright.info.clear()
    return upright

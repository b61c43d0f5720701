"""The texture atlas: read, resized and encoded."""

from __future__ import annotations

from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError

__all__ = ["encode_picture", "encode_texture", "read_picture"]

MIME = {"WEBP": "image/webp", "JPEG": "image/jpeg"}


def read_picture(path: Path) -> NDArray[np.uint8]:
    """A picture as (H, W, 3) uint8 sRGB.

    Raises
    ------
    InputError : the file is not a picture.
    """
    return np.asarray(_open(path))


def _open(path: Path) -> Any:
    from PIL import Image, UnidentifiedImageError

    # An atlas of 16384 pixels is ours, not an attack: lift Pillow's guard for this file.
    guard, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
    try:
        with Image.open(path) as opened:
            return opened.convert("RGB")
    except (OSError, UnidentifiedImageError) as error:
        raise InputError(f"{path}: cannot be read as a picture ({error})") from error
    finally:
        Image.MAX_IMAGE_PIXELS = guard


def _encoded(picture: Any, longest: int, kind: str, quality: int) -> tuple[bytes, str]:
    from PIL import Image

    scale = longest / max(picture.size)
    if scale < 1.0:
        width, height = (max(1, round(side * scale)) for side in picture.size)
        picture = picture.resize((width, height), Image.Resampling.LANCZOS)
    stream = BytesIO()
    if kind == "WEBP":
        picture.save(stream, "WEBP", quality=quality, method=4)
    else:
        picture.save(stream, "JPEG", quality=quality, optimize=True, subsampling=0)
    return stream.getvalue(), MIME[kind]


def encode_texture(path: Path, longest: int, kind: str, quality: int) -> tuple[bytes, str]:
    """The atlas at most `longest` pixels long, as WEBP or JPEG; gives bytes and MIME type."""
    return _encoded(_open(path), longest, kind, quality)


def encode_picture(
    picture: NDArray[np.uint8], longest: int, kind: str, quality: int
) -> tuple[bytes, str]:
    """The same of an (H, W, 3) array."""
    from PIL import Image

    return _encoded(Image.fromarray(picture), longest, kind, quality)

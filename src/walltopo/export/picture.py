"""The texture atlas: resized and encoded."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from numpy.typing import NDArray

__all__ = ["encode_picture"]

MIME = {"WEBP": "image/webp", "JPEG": "image/jpeg"}


def encode_picture(
    picture: NDArray[np.uint8], longest: int, kind: str, quality: int
) -> tuple[bytes, str]:
    """An (H, W, 3) picture at most `longest` pixels long, as WEBP or JPEG; bytes and MIME type."""
    from PIL import Image

    image = Image.fromarray(picture)
    scale = longest / max(image.size)
    if scale < 1.0:
        width, height = (max(1, round(side * scale)) for side in image.size)
        image = image.resize((width, height), Image.Resampling.LANCZOS)
    stream = BytesIO()
    if kind == "WEBP":
        image.save(stream, "WEBP", quality=quality, method=4)
    else:
        image.save(stream, "JPEG", quality=quality, optimize=True, subsampling=0)
    return stream.getvalue(), MIME[kind]

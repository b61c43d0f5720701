"""Sample, resize, encode and decode the texture atlas."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from numpy.typing import NDArray

QUALITY = 80  # percent, of the pictures in a GLB or USDZ
# MIME type of each format, and options of Pillow's encoder besides the quality.
FORMATS = {
    "WEBP": ("image/webp", {"method": 4}),
    "JPEG": ("image/jpeg", {"optimize": True, "subsampling": 0}),
}


def texels(picture: NDArray[np.uint8], uv: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Return (n, 3) colours at (n, 2) texture coordinates (origin at the top left)."""
    height, width = picture.shape[:2]
    column = np.clip((uv[:, 0] * width).astype(int), 0, width - 1)
    row = np.clip((uv[:, 1] * height).astype(int), 0, height - 1)
    return picture[row, column]


def encode_picture(
    picture: NDArray[np.uint8], longest: int, kind: str, quality: int = QUALITY
) -> tuple[bytes, str]:
    """Return an (H, W, 3) picture, at most `longest` pixels long, encoded: bytes and MIME type."""
    from PIL import Image

    image = Image.fromarray(picture)
    scale = longest / max(image.size)
    if scale < 1.0:
        width, height = (max(1, round(side * scale)) for side in image.size)
        image = image.resize((width, height), Image.Resampling.LANCZOS)
    mime, options = FORMATS[kind]
    stream = BytesIO()
    image.save(stream, kind, quality=quality, **options)
    return stream.getvalue(), mime


def decode_picture(data: bytes) -> NDArray[np.uint8]:
    """Return the (H, W, 3) sRGB picture in the bytes that `encode_picture` returned."""
    from PIL import Image

    with Image.open(BytesIO(data)) as image:
        return np.asarray(image.convert("RGB"), dtype=np.uint8)

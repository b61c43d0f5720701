"""A gym's floor plan: a picture from above, and the walls' places on it."""

from __future__ import annotations

import hashlib
import threading
import warnings
from io import BytesIO
from typing import TYPE_CHECKING, Final

from walltopo_gym.errors import RequestError, TooManyError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import FloorPlan

if TYPE_CHECKING:
    from PIL import Image


_FORMATS: Final = ("JPEG", "PNG", "WEBP")
_MAX_PIXELS: Final = 25_000_000
_KEPT: Final = 1600  # pixels of the longer side
_PATIENCE_S: Final = 5.0
_SOON_S: Final = 60
DECODING: Final = threading.Lock()


def key_of(sha256: str) -> str:
    """Return the key of a plan's picture in the store."""
    return f"plans/{sha256}.png"


def store_plan_picture(store: FileStore, gym: Gym, content: bytes) -> FloorPlan:
    """Store a picture as the gym's plan: re-encoded from its pixels, at most 1600 across.

    One picture is decoded at a time, because a small file can be a large picture.

    Raises
    ------
    RequestError : the format is not supported, or it is too large. TooManyError : others are being
        decoded.
    """
    if not DECODING.acquire(timeout=_PATIENCE_S):
        raise TooManyError("plans-busy", _SOON_S)
    try:
        upright = _decode_picture(content)
        out = BytesIO()
        upright.save(out, "PNG", optimize=True)
    finally:
        DECODING.release()
    sha256 = hashlib.sha256(out.getvalue()).hexdigest()
    store.put(key_of(sha256), out.getvalue())
    return FloorPlan(gym_id=gym.id, sha256=sha256, width=upright.width, height=upright.height)


def _decode_picture(content: bytes) -> Image.Image:
    """Return the picture upright, at most 1600 across."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(BytesIO(content), formats=_FORMATS) as image:
                if image.width * image.height > _MAX_PIXELS:
                    raise RequestError(
                        "floor-too-large",
                        "floor-smaller",
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
        raise RequestError("floor-not-picture", "floor-send") from error
    upright.thumbnail((_KEPT, _KEPT))
    return upright

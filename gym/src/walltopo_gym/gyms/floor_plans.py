"""A gym's floor plan: a picture from above, and where on it each wall is."""

from __future__ import annotations

import hashlib
import threading
import warnings
from io import BytesIO
from typing import TYPE_CHECKING, Final

from walltopo.core import InputError
from walltopo_gym.errors import TooManyError
from walltopo_gym.gyms.models import FloorPlan, Gym
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from PIL import Image


_FORMATS: Final = ("JPEG", "PNG", "WEBP")
_MOST_PIXELS: Final = 25_000_000
_KEPT: Final = 1600  # pixels of the longer side
_PATIENCE_S: Final = 5.0
_SOON_S: Final = 60
DECODING: Final = threading.Lock()


def key_of(sha256: str) -> str:
    """Where a plan's picture lies in the store."""
    return f"plans/{sha256}.png"


def keep_picture(store: FileStore, gym: Gym, content: bytes) -> FloorPlan:
    """Keep a picture as the gym's plan: its pixels alone, made anew, at most 1600 across.

    One picture is decoded at a time: a small file can be a large picture.

    Raises
    ------
    InputError : it is no picture of ours, or too large. TooManyError : others are being decoded.
    """
    if not DECODING.acquire(timeout=_PATIENCE_S):
        raise TooManyError("other floor plans are being read", _SOON_S)
    try:
        upright = _decoded(content)
        out = BytesIO()
        upright.save(out, "PNG", optimize=True)
    finally:
        DECODING.release()
    sha256 = hashlib.sha256(out.getvalue()).hexdigest()
    store.put(key_of(sha256), out.getvalue())
    return FloorPlan(gym_id=gym.id, sha256=sha256, width=upright.width, height=upright.height)


def _decoded(content: bytes) -> Image.Image:
    """Return the picture upright, at most 1600 across."""
    from PIL import Image, ImageOps, UnidentifiedImageError

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error", Image.DecompressionBombWarning)
            with Image.open(BytesIO(content), formats=_FORMATS) as image:
                if image.width * image.height > _MOST_PIXELS:
                    raise InputError(
                        f"the floor plan has {image.width} x {image.height} pixels",
                        f"Make it smaller: at most {_MOST_PIXELS // 1_000_000} megapixels.",
                    )
                upright = ImageOps.exif_transpose(image).convert("RGB")
    except (UnidentifiedImageError, Image.DecompressionBombError, Image.DecompressionBombWarning,
            OSError, ValueError, SyntaxError) as error:  # fmt: skip
        raise InputError("the floor plan is no picture", "Send a JPEG, PNG or WebP.") from error
    upright.thumbnail((_KEPT, _KEPT))
    return upright

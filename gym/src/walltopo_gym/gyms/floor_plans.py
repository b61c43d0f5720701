"""A gym's floor plan: a picture from above, and where on it each wall is."""

from __future__ import annotations

import hashlib
import warnings
from io import BytesIO
from typing import Final

from walltopo.core import InputError
from walltopo_gym.gyms.models import FloorPlan, Gym
from walltopo_gym.storage.files import FileStore

__all__ = ["key_of", "keep_picture"]

_FORMATS: Final = ("JPEG", "PNG", "WEBP")
_MOST_PIXELS: Final = 25_000_000
_KEPT: Final = 1600  # pixels of the longer side


def key_of(sha256: str) -> str:
    """Where a plan's picture lies in the store."""
    return f"plans/{sha256}.png"


def keep_picture(store: FileStore, gym: Gym, content: bytes) -> FloorPlan:
    """Keep a picture as the gym's plan: its pixels alone, made anew, at most 1600 across.

    Raises
    ------
    InputError : it is no picture of ours, or too large.
    """
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
    out = BytesIO()
    upright.save(out, "PNG", optimize=True)
    sha256 = hashlib.sha256(out.getvalue()).hexdigest()
    store.put(key_of(sha256), out.getvalue())
    return FloorPlan(gym_id=gym.id, sha256=sha256, width=upright.width, height=upright.height)

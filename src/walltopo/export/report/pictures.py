"""Pictures inside the report's one file."""

from __future__ import annotations

import base64
from io import BytesIO
from pathlib import Path
from typing import Any

from walltopo.core import InputError
from walltopo.imaging.opening import open_picture

__all__ = ["data_url", "thumbnail"]


def data_url(picture: Any, quality: int) -> str:
    """A Pillow image as a `data:` address."""
    stream = BytesIO()
    picture.save(stream, "WEBP", quality=quality)
    return "data:image/webp;base64," + base64.b64encode(stream.getvalue()).decode("ascii")


def thumbnail(path: Path, longest: int) -> str | None:
    """A small copy of a picture as a `data:` address; None where it cannot be read."""
    try:
        with open_picture(path) as opened:
            opened.thumbnail((longest, longest))
            return data_url(opened.convert("RGBA" if opened.mode == "RGBA" else "RGB"), 72)
    except InputError:
        return None

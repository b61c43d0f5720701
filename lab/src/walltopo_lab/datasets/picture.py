"""Pictures of labelled sets: opened by Pillow, only in formats that cameras and screens write."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.core import InputError
from walltopo.core.errors import naming
from walltopo.core.picture_size import check_picture_size

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["opened_picture"]

# Pillow knows some forty more, among them some that start programs.
FORMATS = ("JPEG", "PNG", "WEBP", "BMP", "TIFF")


@contextmanager
def opened_picture(source: Path | bytes, name: object) -> Iterator[Image]:
    """A picture, not decoded yet.

    Parameters
    ----------
    source : a file, or the bytes of one.
    name : what messages call it.

    Raises
    ------
    InputError : not a picture, damaged, or too large; in the block as well.
    """
    from PIL import Image

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            stream = source if isinstance(source, Path) else io.BytesIO(source)
            with Image.open(stream, formats=FORMATS) as image, naming(name):
                check_picture_size(*image.size)
                yield image
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:
        raise InputError(f"{name}: cannot be read as a picture ({error})") from error

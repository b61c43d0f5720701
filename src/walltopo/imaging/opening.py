"""The one door for pictures from outside: which formats are decoded at all, and how large.

Pillow decodes some forty formats under any suffix; one of them starts another program (EPS), most
are decoders that hardly anyone looks after. Only what cameras and annotation tools write is let in.
"""

from __future__ import annotations

import io
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

from walltopo.core import InputError, WalltopoError
from walltopo.core.picture_size import MOST_PIXELS

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["open_picture"]

# By how a file begins (at which byte, with what); a JPEG of several pictures (MPO) opens as JPEG.
_SIGNATURES: Final = (
    (0, b"\xff\xd8\xff", ("JPEG",)),
    (0, b"\x89PNG", ("PNG",)),
    (0, b"II*\0", ("TIFF",)),
    (0, b"MM\0*", ("TIFF",)),
    (0, b"BM", ("BMP",)),
    (8, b"WEBP", ("WEBP",)),
    (4, b"ftyp", ("HEIF", "AVIF")),
)
# Their readers take the whole file into memory before they know what is in it.
_READ_WHOLE: Final = {"HEIF", "AVIF", "WEBP"}
_MOST_WHOLE_BYTES: Final = 200_000_000

_SWAP = threading.Lock()


@contextmanager
def open_picture(source: Path | bytes) -> Iterator[Image]:
    """A picture, opened and not yet decoded; whatever its decoder raises in the block is told.

    Parameters
    ----------
    source : a file, or what is in one.

    Raises
    ------
    InputError : no picture, of a format that is not let in, too large, damaged or unreadable. The
        message is the reason alone; the caller adds the file's name.
    MemoryError : as it is.
    """
    from PIL import UnidentifiedImageError

    try:
        with _open(source) as opened:
            if opened.width * opened.height > MOST_PIXELS:
                raise InputError(
                    f"{opened.width}x{opened.height} pixels, too large to be a phone photo"
                )
            yield opened
    except (WalltopoError, MemoryError):
        raise
    except UnidentifiedImageError as error:
        raise InputError(
            "not an image that is read here (JPEG, PNG, HEIC, AVIF, WebP, TIFF, BMP), whatever "
            "its name says"
        ) from error
    except PermissionError as error:
        raise InputError("cannot be read (permission denied)") from error
    except FileNotFoundError as error:
        raise InputError("no such file") from error
    except Exception as error:
        # Decoders meet damage with whatever comes: struct.error, IndexError, RuntimeError...
        raise InputError(f"damaged or cut off ({error or type(error).__name__})") from error


def _open(source: Path | bytes) -> Image:
    from PIL import Image, UnidentifiedImageError

    head, size = _head(source)
    formats = next((f for at, sign, f in _SIGNATURES if head[at:].startswith(sign)), ())
    if not formats:
        raise UnidentifiedImageError
    if _READ_WHOLE & set(formats) and size > _MOST_WHOLE_BYTES:
        raise InputError(f"a file of {size / 1e6:.0f} MB, too large to be a phone photo")
    if "HEIF" in formats:
        import pillow_heif

        pillow_heif.register_heif_opener()
        Image.init()  # of plugins, for Pillow may be built without one
    stream = io.BytesIO(source) if isinstance(source, bytes) else source
    # Pillow's own bound is below what phones have and one for the whole process: it is put back.
    with _SWAP:
        bound, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            return Image.open(
                stream, formats=[f for f in formats if f != "AVIF" or f in Image.OPEN]
            )
        finally:
            Image.MAX_IMAGE_PIXELS = bound


def _head(source: Path | bytes) -> tuple[bytes, int]:
    """The first bytes of a picture, and how many there are in all."""
    if isinstance(source, bytes):
        return source[:12], len(source)
    if source.exists() and not source.is_file():
        raise InputError("not a file")  # to open a pipe would wait for its other end
    with source.open("rb") as stream:
        return stream.read(12), source.stat().st_size

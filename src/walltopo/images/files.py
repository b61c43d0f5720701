"""Image files as arrays: size limits, decoding, and silence of the C decoders on stderr."""

from __future__ import annotations

import io
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, WalltopoError
from walltopo.core.mask import MOST_PIXELS

if TYPE_CHECKING:
    from PIL.Image import Image


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W, 3) uint8 RGB.

    Raises
    ------
    InputError : the file is missing, or damaged, or no picture; names it.
    """
    import cv2

    picture = _read(path, cv2.IMREAD_COLOR)[..., ::-1]
    return np.ascontiguousarray(picture, dtype=np.uint8)


def read_grey(path: Path) -> NDArray[np.uint8]:
    """A picture, turned upright by its EXIF, as (H, W) uint8, grey by OpenCV's weights.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return np.asarray(_read(path, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def read_stored(path: Path) -> NDArray[np.generic]:
    """A picture as it is stored: (H, W) or (H, W, C in BGR order), of the file's own depth.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return _read(path, cv2.IMREAD_UNCHANGED)


def _read(path: Path, mode: int) -> NDArray[np.generic]:
    import cv2

    if not path.is_file():
        raise InputError(f"{path}: no such picture", _HINT)
    try:
        # OpenCV decodes more formats than are let in, and up to a billion pixels.
        with open_picture(path), hushed():
            picture = cv2.imread(str(path), mode)
    except InputError as error:
        raise InputError(f"{path}: {error.message}", _HINT) from error
    if picture is None:
        raise InputError(f"{path}: not a picture, or damaged", _HINT)
    return np.asarray(picture)


_HINT = "If it is a scan's own photo, run the scan again: walltopo scan --from ingest."

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


_STDERR = 2

_lock = threading.Lock()

_inside = 0  # threads that decode at this moment

_saved = -1  # the terminal's descriptor meanwhile


@contextmanager
def hushed() -> Iterator[None]:
    """Send descriptor 2 nowhere in the block: libjpeg, libpng and libtiff write there directly.

    Whether a picture could be read is told by the decoder's result. Any number of threads may be
    inside at once; the last one out gives the terminal back.
    """
    _enter()
    try:
        yield
    finally:
        _leave()


def _enter() -> None:
    global _inside, _saved
    with _lock:
        _inside += 1
        if _inside > 1:
            return
        try:
            _saved = os.dup(_STDERR)
        except OSError:  # closed: nobody would see it anyway
            return
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, _STDERR)
        os.close(nowhere)


def _leave() -> None:
    global _inside, _saved
    with _lock:
        _inside -= 1
        if _inside == 0 and _saved >= 0:
            os.dup2(_saved, _STDERR)
            os.close(_saved)
            _saved = -1

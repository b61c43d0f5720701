"""Read image files as arrays: limit their size, and silence the C decoders' stderr."""

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
from walltopo.core.view import MAX_PIXELS

if TYPE_CHECKING:
    from PIL.Image import Image


def read_rgb(path: Path) -> NDArray[np.uint8]:
    """Read a picture as (H, W, 3) uint8 RGB, upright by its EXIF orientation.

    Raises
    ------
    InputError : the file is missing, damaged or no picture; the message names the file.
    """
    import cv2

    picture = _read(path, cv2.IMREAD_COLOR)[..., ::-1]
    return np.ascontiguousarray(picture, dtype=np.uint8)


def read_grey(path: Path) -> NDArray[np.uint8]:
    """Read a picture as (H, W) uint8 grey (OpenCV's weights), upright by its EXIF orientation.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return np.asarray(_read(path, cv2.IMREAD_GRAYSCALE), dtype=np.uint8)


def read_stored(path: Path) -> NDArray[np.generic]:
    """Read a picture as stored: (H, W) or (H, W, C) in BGR order, with the file's bit depth.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    import cv2

    return _read(path, cv2.IMREAD_UNCHANGED)


def read_indices(path: Path) -> NDArray[np.uint8] | None:
    """Read the (H, W) palette indices of a picture; None if it has no palette.

    Raises
    ------
    InputError : as in `read_rgb`.
    """
    if not path.is_file():
        raise InputError(f"{path}: no such picture", _HINT)
    try:
        with open_picture(path) as picture:
            if picture.mode != "P":
                return None
            return np.array(picture, dtype=np.uint8)
    except (InputError, OSError, SyntaxError) as error:
        raise InputError(f"{path}: {getattr(error, 'message', error)}", _HINT) from error


def _read(path: Path, mode: int) -> NDArray[np.generic]:
    import cv2

    if not path.is_file():
        raise InputError(f"{path}: no such picture", _HINT)
    try:
        # `open_picture` checks format and size; OpenCV accepts more formats and a billion pixels.
        with open_picture(path), silence_stderr():
            # `imread` crashes on a path that is not UTF-8.
            picture = cv2.imdecode(np.fromfile(path, dtype=np.uint8), mode)
    except InputError as error:
        raise InputError(f"{path}: {error.message}", _HINT) from error
    if picture is None:
        raise InputError(f"{path}: not a picture, or damaged", _HINT)
    return np.asarray(picture)


_HINT = "If it is a scan's own photo, run the scan again: walltopo scan --from ingest."

# Offset and bytes of each format's signature; a multi-picture JPEG (MPO) opens as JPEG.
_SIGNATURES: Final = (
    (0, b"\xff\xd8\xff", ("JPEG",)),
    (0, b"\x89PNG", ("PNG",)),
    (0, b"II*\0", ("TIFF",)),
    (0, b"MM\0*", ("TIFF",)),
    (0, b"BM", ("BMP",)),
    (8, b"WEBP", ("WEBP",)),
    (4, b"ftyp", ("HEIF", "AVIF")),
)

# Brands of an ISO file ("ftyp") that mean pictures; videos have other ones.
_PICTURE_BRANDS: Final = (b"heic", b"heix", b"hevc", b"mif1", b"msf1", b"avif", b"avis")


def is_picture(head: bytes) -> bool:
    """Return whether a file begins like a picture that can be read here, by its first 12 bytes."""
    if head[4:8] == b"ftyp":
        return head[8:12] in _PICTURE_BRANDS
    return any(head[at:].startswith(sign) for at, sign, _ in _SIGNATURES)


# Decoders that read the whole file into memory before they know the image size.
_READ_WHOLE: Final = {"HEIF", "AVIF", "WEBP"}

_MAX_WHOLE_BYTES: Final = 200_000_000

_LIMIT_LOCK = threading.Lock()


@contextmanager
def open_picture(source: Path | bytes) -> Iterator[Image]:
    """Open a picture without decoding it; convert decoder errors to InputError.

    Parameters
    ----------
    source : path or content of a file.

    Raises
    ------
    InputError : no picture, an unsupported format, too large, damaged or unreadable. The message
        omits the file's name; the caller adds it.
    MemoryError : memory ran out.
    """
    from PIL import UnidentifiedImageError

    try:
        with _open(source) as opened:
            if opened.width * opened.height > MAX_PIXELS:
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
        # Decoders raise many types for damaged files: struct.error, IndexError, RuntimeError...
        raise InputError(f"damaged or cut off ({error or type(error).__name__})") from error


def _open(source: Path | bytes) -> Image:
    from PIL import Image, UnidentifiedImageError

    head, size = _read_head(source)
    formats = next((f for at, sign, f in _SIGNATURES if head[at:].startswith(sign)), ())
    if not formats:
        raise UnidentifiedImageError
    if _READ_WHOLE & set(formats) and size > _MAX_WHOLE_BYTES:
        raise InputError(f"a file of {size / 1e6:.0f} MB, too large to be a phone photo")
    if "HEIF" in formats:
        import pillow_heif

        pillow_heif.register_heif_opener()
        Image.init()  # load plugins, because Pillow may be built without a format
    stream = io.BytesIO(source) if isinstance(source, bytes) else source
    # Pillow's pixel limit is global and below phone photos; lift it temporarily.
    with _LIMIT_LOCK:
        bound, Image.MAX_IMAGE_PIXELS = Image.MAX_IMAGE_PIXELS, None
        try:
            return Image.open(
                stream, formats=[f for f in formats if f != "AVIF" or f in Image.OPEN]
            )
        finally:
            Image.MAX_IMAGE_PIXELS = bound


def _read_head(source: Path | bytes) -> tuple[bytes, int]:
    """Return the first bytes and the size of a picture."""
    if isinstance(source, bytes):
        return source[:12], len(source)
    if source.exists() and not source.is_file():
        raise InputError("not a file")  # opening a pipe would block
    with source.open("rb") as stream:
        return stream.read(12), source.stat().st_size


_STDERR = 2

_lock = threading.Lock()

_inside = 0  # number of threads in `silence_stderr`

_saved = -1  # copy of the original descriptor 2


@contextmanager
def silence_stderr() -> Iterator[None]:
    """Redirect descriptor 2 to null in the block: libjpeg, libpng and libtiff write to it directly.

    The decoder's result tells whether a picture could be read. Several threads may be in the block;
    the last one restores the descriptor.
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
        except OSError:  # descriptor 2 is closed already
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

"""Decode one image file as upright 8-bit sRGB, reduced, and read its focal length.

Only pixels and the focal length leave this module. Personal EXIF (place, time, owner, serial
numbers) is dropped.

A photo of up to `_EXACT_PIXELS` is decoded whole and then reduced. A larger one is never held at
full size if its format permits: JPEG is decoded at a half, a quarter or an eighth; other formats
are reduced strip by strip.
"""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.reconstruct.ingest.decoding import MemoryBudget
from walltopo.reconstruct.settings import IngestSettings

if TYPE_CHECKING:
    from PIL.Image import Image


import math
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING

from walltopo.images.files import open_picture
from walltopo.images.hdr import TRANSFERS, Transfer, to_srgb8
from walltopo.reconstruct.ingest.decoding import bytes_to_open

if TYPE_CHECKING:
    from PIL.Image import Image


_ORIENTATION, _EXIF_IFD, _FOCAL_35MM = 0x0112, 0x8769, 0xA405
_DIAGONAL_35MM = math.hypot(36.0, 24.0)
_EXACT_PIXELS: Final = 66_000_000
_STRIP_PIXELS: Final = 4_000_000


@dataclass(frozen=True)
class DecodedPhoto:
    """An upright 8-bit sRGB image.

    Parameters
    ----------
    focal_px : focal length in pixels of the image; None if EXIF has none.
    source_pixels : number of pixels of the file's picture.
    """

    image: Image
    focal_px: float | None
    source_pixels: int


@contextmanager
def decoded_photo(
    path: Path, settings: IngestSettings, budget: MemoryBudget
) -> Iterator[DecodedPhoto]:
    """Decode one photo to at most `max_side` pixels; reserve its memory during the block.

    Raises
    ------
    InputError : the file is not an image, is truncated, too small, too elongated or too large. The
        message omits the file's name; the caller adds it.
    """
    from PIL import ImageOps

    with ExitStack() as held:
        with open_picture(path) as opened:
            full = opened.size
            check_shape(full, settings)
            _check_preview(opened)
            factor = _plan_reduction(opened, settings.max_side)
            drafted = opened.size != full
            held.enter_context(
                budget.reserve(bytes_to_open(opened, full, factor, settings.max_side))
            )
            strip, size = _strip_decoder(opened, factor)
            # EXIF is read after decoding: Pillow decodes a PNG to find it, and rotates TIFF itself.
            _check_panorama(opened)
            orientation, focal_px = opened.getexif().get(_ORIENTATION, 1), _focal_px(opened, full)
            rgb = _to_srgb8(opened, strip, size, factor)
            del strip
            if rgb is not opened:
                opened.close()  # free its pixels before new ones are allocated
        if factor > 1 or drafted:
            rgb = _reduce_exactly(rgb, full if drafted else size, settings.max_side)
        rgb.getexif()[_ORIENTATION] = orientation
        ImageOps.exif_transpose(rgb, in_place=True)
        image = reduce_to(rgb, settings.max_side)
        del rgb
        if focal_px is not None:
            focal_px *= max(image.size) / max(full)
        yield DecodedPhoto(image, focal_px, full[0] * full[1])


def check_shape(size: tuple[int, int], settings: IngestSettings) -> None:
    """Raise InputError for thumbnails and panoramas; the message omits the file's name."""
    short, long = sorted(size)
    if short < settings.min_side:
        raise InputError(f"{size[0]}x{size[1]} px, smaller than {settings.min_side} px")
    if long / short > settings.max_aspect:
        raise InputError(f"{size[0]}x{size[1]} px, a panorama; it has no single camera")


# TIFF's tag NewSubfileType; bit 0 marks a smaller version of another picture in the file.
_SUBFILE_TYPE = 254
_MIN_PREVIEW = 1280  # px: previews of this size are as good as photos


def _check_preview(opened: Image) -> None:
    """Raise InputError for a raw photo (DNG) whose small preview is all that can be read here."""
    tags = getattr(opened, "tag_v2", {})
    if tags.get(_SUBFILE_TYPE, 0) & 1 and max(opened.size) < _MIN_PREVIEW:
        raise InputError(
            f"a raw photo, of which only the preview of {opened.width}x{opened.height} px can be "
            "read; export it as JPEG"
        )


# EXIF's tag CustomRendered; Apple's cameras write 6 for a panorama.
_CUSTOM_RENDERED, _APPLE_PANORAMA = 0xA401, 6


def _check_panorama(opened: Image) -> None:
    """Raise InputError for a photo that says it was stitched; the message omits the file's name.

    Sources: Google's Photo Sphere XMP (GPano), Apple's use of EXIF's CustomRendered.
    """
    xmp = opened.info.get("xmp") or opened.info.get("XML:com.adobe.xmp") or b""
    if isinstance(xmp, str):
        xmp = xmp.encode("utf-8", "replace")
    if b"GPano:ProjectionType" in xmp or b"GPano:FullPanoWidthPixels" in xmp:
        raise InputError("a 360-degree photo or a stitched panorama; it has no single camera")
    try:
        rendered = opened.getexif().get_ifd(_EXIF_IFD).get(_CUSTOM_RENDERED)
    except (ValueError, TypeError, KeyError, SyntaxError, OSError):
        return
    if rendered == _APPLE_PANORAMA:
        raise InputError("a panorama that was stitched by the phone; it has no single camera")


def reduce_to(image: Image, longest: int) -> Image:
    """Return the image, reduced if its longer side exceeds `longest`."""
    if max(image.size) <= longest:
        return image
    factor = longest / max(image.size)
    return image.resize((round(image.width * factor), round(image.height * factor)))


def _reduce_exactly(image: Image, full: tuple[int, int], longest: int) -> Image:
    """Resize an image that was reduced by an integer factor and may lack its last row and
    column."""
    factor = round(max(full) / max(image.size))
    width, height = (max(1, round(side * longest / max(full))) for side in full)
    return image.resize((width, height), box=(0, 0, full[0] / factor, full[1] / factor))


def _plan_reduction(opened: Image, longest: int) -> int:
    """Set a huge JPEG to decode at reduced size; return the integer factor for other formats."""
    if opened.width * opened.height <= _EXACT_PIXELS:
        return 1
    if opened.format in ("JPEG", "MPO"):
        share = longest / max(opened.size)
        opened.draft(None, (math.ceil(opened.width * share), math.ceil(opened.height * share)))
        return 1
    return max(1, max(opened.size) // longest)


def _focal_px(image: Image, size: tuple[int, int]) -> float | None:
    """Return the focal length in pixels from the 35 mm equivalent, which CIPA defines by the
    diagonal."""
    try:
        exif = image.getexif()
        value = exif.get_ifd(_EXIF_IFD).get(_FOCAL_35MM) or exif.get(_FOCAL_35MM)
        focal = float(value) if value else 0.0
    except (ValueError, TypeError, ZeroDivisionError, KeyError, SyntaxError):
        return None
    if not 5.0 <= focal <= 1000.0:
        return None
    return focal / _DIAGONAL_35MM * math.hypot(*size)


Strip = Callable[[int, int], "Image"]


def _strip_decoder(opened: Image, factor: int) -> tuple[Strip, tuple[int, int]]:
    """Return a function that crops rows `top` to `bottom`, and the size of the whole image."""
    from PIL import Image as Pil

    if opened.format == "HEIF" and factor > 1:
        # Read libheif's buffer in place, because Pillow's copy would double the memory.
        heif = opened._heif_file[opened.tell()]  # type: ignore[attr-defined]
        array = np.asarray(heif)[:, : heif.size[0]]
        return lambda top, bottom: _with_info(Pil.fromarray(array[top:bottom]), opened), heif.size
    opened.load()
    width, height = opened.size
    return lambda top, bottom: opened.crop((0, top, width, bottom)), (width, height)


def _to_srgb8(opened: Image, strip: Strip, size: tuple[int, int], factor: int) -> Image:
    """Convert to 8-bit sRGB from any depth, palette, alpha or profile, reduced by `factor`.

    The conversion runs strip by strip, so that no second full-size image is allocated.
    """
    from PIL import Image as Pil

    special = opened.info.keys() & {"icc_profile", "transparency"} or _hdr_transfer(opened)
    plain = opened.mode == "RGB" and not special
    if plain and factor == 1:
        return opened
    width, height = size
    result = Pil.new("RGB", (-(-width // factor), -(-height // factor)))
    rows = max(1, _STRIP_PIXELS // (width * factor)) * factor
    tops = range(0, height, rows)
    convert = _srgb_converter(opened, lambda: (strip(top, min(top + rows, height)) for top in tops))
    for top in tops:
        rgb = convert(strip(top, min(top + rows, height)))
        result.paste(rgb.reduce(factor) if factor > 1 else rgb, (0, top // factor))
    return result


def _hdr_transfer(opened: Image) -> Transfer | None:
    """Return the HDR transfer function that a HEIF or AVIF names; None for SDR."""
    nclx = opened.info.get("nclx_profile") or {}
    return TRANSFERS.get(int(nclx.get("transfer_characteristics", 0)))


def _with_info(strip: Image, opened: Image) -> Image:
    strip.info = opened.info
    return strip


def _srgb_converter(
    opened: Image, strips: Callable[[], Iterator[Image]]
) -> Callable[[Image], Image]:
    """Return a function that converts a strip of this image to 8-bit sRGB."""
    if opened.mode.startswith("I") or opened.mode == "F":
        deep = any(np.asarray(strip).max(initial=0) > 255 for strip in strips())
        return lambda image: _grey8(image, 65535.0 if deep else 255.0)
    if opened.mode in ("RGBA", "LA", "PA") or "transparency" in opened.info:
        return _on_white
    return _profile_converter(opened)


def _grey8(image: Image, top: float) -> Image:
    from PIL import Image as Pil

    values = np.asarray(image, dtype=np.float64)
    return Pil.fromarray(np.clip(values / top * 255.0, 0, 255).astype(np.uint8)).convert("RGB")


def _on_white(image: Image) -> Image:
    from PIL import Image as Pil

    rgba = image.convert("RGBA")
    white = Pil.new("RGBA", rgba.size, (255, 255, 255, 255))
    return Pil.alpha_composite(white, rgba).convert("RGB")


def _profile_converter(opened: Image) -> Callable[[Image], Image]:
    """Return a converter from the embedded colour profile (phones write Display P3) to sRGB."""
    from PIL import Image as Pil
    from PIL import ImageCms

    transfer = _hdr_transfer(opened)
    if transfer is not None and opened.mode == "RGB":
        return lambda image: Pil.fromarray(to_srgb8(np.asarray(image, dtype=np.uint8), transfer))
    profile = opened.info.get("icc_profile")
    if not profile or opened.mode not in ("RGB", "CMYK", "L"):
        return lambda image: image.convert("RGB")
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        srgb = ImageCms.createProfile("sRGB")
        transform = ImageCms.buildTransform(source, srgb, opened.mode, "RGB")
    except (ImageCms.PyCMSError, OSError):
        # Ignore a broken profile, as image viewers do.
        return lambda image: image.convert("RGB")
    return lambda image: ImageCms.applyTransform(image, transform) or image.convert("RGB")


MIN_SHARPNESS = 3.0  # a photo of a wall below this value is unusable


_SHARPNESS_WIDTH = 1024


def sharpness(rgb: NDArray[np.uint8]) -> float:
    """Return the variance of the Laplacian of the grey image reduced to 1024 px.

    Source: Pech-Pacheco et al., "Diatom autofocusing in brightfield microscopy" (2000).

    Parameters
    ----------
    rgb : (H, W, 3) uint8.
    """
    import cv2

    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    factor = _SHARPNESS_WIDTH / max(grey.shape)
    if factor < 1.0:
        grey = cv2.resize(grey, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return float(cv2.Laplacian(grey, cv2.CV_64F).var())


def thumbnail(rgb: NDArray[np.uint8], size: int = 64) -> NDArray[np.float32]:
    """Return a (size, size) grey image, values 0 to 255, for comparing photos."""
    import cv2

    grey = cv2.cvtColor(rgb, cv2.COLOR_RGB2GRAY)
    small = cv2.resize(grey, (size, size), interpolation=cv2.INTER_AREA)
    return np.asarray(small, dtype=np.float32)


def motion(before: NDArray[np.float32], after: NDArray[np.float32]) -> float:
    """Return the shift between two thumbnails as a share of their width, by phase correlation."""
    import cv2

    window = cv2.createHanningWindow((before.shape[1], before.shape[0]), cv2.CV_32F)
    (dx, dy), _ = cv2.phaseCorrelate(before, after, window)
    return float(np.hypot(dx, dy) / before.shape[1])

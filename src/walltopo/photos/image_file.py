"""One image file: decode it upright as 8-bit sRGB, and read its focal length.

Personal EXIF (place, time, owner, serial numbers) stays in the source: only pixels and the
focal length in pixels leave this module.
"""

from __future__ import annotations

import io
import math
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walltopo.core import InputError

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["PHOTO_SUFFIXES", "DecodedPhoto", "decode_photo"]

PHOTO_SUFFIXES = {".jpg", ".jpeg", ".png", ".heic", ".heif", ".webp", ".tif", ".tiff"}
_ORIENTATION, _EXIF_IFD, _FOCAL_35MM = 0x0112, 0x8769, 0xA405
_DIAGONAL_35MM = math.hypot(36.0, 24.0)
# More than any phone sensor has; a file beyond it is a stitched picture or an attack.
_MAX_PIXELS = 250_000_000


@dataclass(frozen=True)
class DecodedPhoto:
    """An upright 8-bit sRGB image and its focal length in pixels, None where EXIF has none."""

    image: Image
    focal_px: float | None


def decode_photo(path: Path) -> DecodedPhoto:
    """Decode one photo.

    Raises
    ------
    InputError : the file is not an image, is truncated, or is absurdly large. The message is
        the reason alone; the caller adds the file's name.
    """
    from PIL import Image, ImageOps, UnidentifiedImageError

    _register_heif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)
            with Image.open(path) as opened:
                if opened.width * opened.height > _MAX_PIXELS:
                    raise InputError(
                        f"{opened.width}x{opened.height} pixels, too large to be a phone photo"
                    )
                opened.load()
                upright = ImageOps.exif_transpose(opened)
                focal = _focal_px(opened)
                return DecodedPhoto(_to_srgb8(upright), focal)
    except UnidentifiedImageError as error:
        raise InputError("not an image, whatever its name says") from error
    except Image.DecompressionBombError as error:
        raise InputError("too large to be a phone photo") from error
    except PermissionError as error:
        raise InputError("cannot be read (permission denied)") from error
    except (OSError, SyntaxError, ValueError, EOFError) as error:
        raise InputError(f"damaged or cut off ({error})") from error


def _register_heif() -> None:
    import pillow_heif

    pillow_heif.register_heif_opener()


def _focal_px(image: Image) -> float | None:
    """Focal length in pixels from the 35 mm equivalent, which CIPA defines by the diagonal."""
    try:
        exif = image.getexif()
        value = exif.get_ifd(_EXIF_IFD).get(_FOCAL_35MM) or exif.get(_FOCAL_35MM)
        focal = float(value) if value else 0.0
    except (ValueError, TypeError, ZeroDivisionError, KeyError, SyntaxError):
        return None
    if not 5.0 <= focal <= 1000.0:
        return None
    return focal / _DIAGONAL_35MM * math.hypot(image.width, image.height)


def _to_srgb8(image: Image) -> Image:
    """8-bit RGB in sRGB, whatever depth, palette, alpha or profile came."""
    from PIL import Image as Pil

    if image.mode.startswith("I") or image.mode == "F":
        values = np.asarray(image, dtype=np.float64)
        top = 65535.0 if values.max(initial=0.0) > 255 else 255.0
        grey = np.clip(values / top * 255.0, 0, 255).astype(np.uint8)
        return Pil.fromarray(grey).convert("RGB")
    if image.mode in ("RGBA", "LA", "PA") or "transparency" in image.info:
        rgba = image.convert("RGBA")
        white = Pil.new("RGBA", rgba.size, (255, 255, 255, 255))
        return Pil.alpha_composite(white, rgba).convert("RGB")
    return _apply_profile(image).convert("RGB")


def _apply_profile(image: Image) -> Image:
    """Convert from the embedded colour profile (phones write Display P3) to sRGB."""
    from PIL import ImageCms

    profile = image.info.get("icc_profile")
    if not profile or image.mode not in ("RGB", "CMYK", "L"):
        return image
    try:
        source = ImageCms.ImageCmsProfile(io.BytesIO(profile))
        converted = ImageCms.profileToProfile(
            image, source, ImageCms.createProfile("sRGB"), outputMode="RGB"
        )
    except (ImageCms.PyCMSError, OSError):
        return image  # a broken profile is ignored, as every image viewer does
    return converted if converted is not None else image

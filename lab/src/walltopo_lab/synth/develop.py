"""Development of linear light to a phone JPEG: exposure, white balance, blur, noise, tone, EXIF."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.images.colour import srgb_from_linear
from walltopo_lab.synth.params import PhotoSettings


@dataclass(frozen=True)
class Exposure:
    """The exposure of one photo.

    Parameters
    ----------
    gain : factor on linear light, besides the meter's own.
    balance : (r, g, b) factors.
    blur : (x, y) half length of the hand's motion in pixels.
    noise : spread of the sensor's noise at mid grey, linear.
    """

    gain: float
    balance: tuple[float, float, float]
    blur: tuple[float, float]
    noise: float


def draw_exposure(settings: PhotoSettings, dim: float, rng: np.random.Generator) -> Exposure:
    """Draw a random, plausible exposure; darker halls (`dim` < 1) give more noise."""
    warm, tint = rng.normal(0, 0.025), rng.normal(0, 0.012)
    angle, length = rng.uniform(0, 2 * np.pi), abs(rng.normal(0, settings.blur_px))
    return Exposure(
        float(2.0 ** rng.normal(0, settings.exposure_spread)),
        (1 + float(warm), 1 + float(tint), 1 - float(warm)),
        (float(length * np.cos(angle)), float(length * np.sin(angle))),
        float(0.011 * settings.noise / np.sqrt(min(max(dim, 0.1), 1.5))),
    )


def _motion(image: NDArray[np.float32], blur: tuple[float, float]) -> NDArray[np.float32]:
    import cv2

    soft = cv2.GaussianBlur(image, (0, 0), 0.55)
    if np.hypot(*blur) < 0.3:
        return np.asarray(soft, np.float32)
    total = np.zeros_like(image)
    for t in np.linspace(-1, 1, 5):
        shift = np.array([[1, 0, t * blur[0]], [0, 1, t * blur[1]]], np.float32)
        total += cv2.warpAffine(
            soft, shift, image.shape[1::-1], flags=cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE
        )
    return np.asarray(total / 5, np.float32)


def develop(
    linear: NDArray[np.float32], exposure: Exposure, rng: np.random.Generator
) -> NDArray[np.uint8]:
    """Return (H, W, 3) uint8 sRGB of linear radiance (H, W, 3).

    As phones do, the meter brings the mean of the brighter half near mid grey. It corrects only two
    thirds of the way, so that dark halls stay dark.
    """
    bright = float(np.percentile(linear[::8, ::8].mean(axis=2), 70)) + 1e-4
    gain = (0.36 / bright) ** 0.67 * exposure.gain * 1.15
    image = _motion(linear, exposure.blur) * np.float32(gain)
    image = image * np.asarray(exposure.balance, np.float32)
    spread = exposure.noise * np.sqrt(np.maximum(image, 0) * 0.8 + 0.02)
    image = image + spread * rng.standard_normal(image.shape, dtype=np.float32)
    image = np.maximum(image, 0)
    image = image * (1 + image / 9.0) / (1 + image * 0.42)  # shoulder of a phone's tone curve
    srgb = srgb_from_linear(image)
    return np.asarray(np.clip(srgb * 255 + 0.5, 0, 255), np.uint8)


def write_photo(path: Path, pixels: NDArray[np.uint8], settings: PhotoSettings) -> None:
    """Write a JPEG with a phone's EXIF about its lens (nothing personal)."""
    from PIL import Image
    from PIL.TiffImagePlugin import IFDRational

    picture = Image.fromarray(pixels)
    exif = picture.getexif()
    exif[271], exif[272] = "Rendered", f"Phone {round(settings.focal_35mm)}mm"
    details = exif.get_ifd(0x8769)
    details[37386] = IFDRational(round(settings.focal_35mm * 100 / 5.02), 100)
    details[41989] = round(settings.focal_35mm)
    details[40962], details[40963] = pixels.shape[1], pixels.shape[0]
    picture.save(path, "JPEG", quality=settings.quality, exif=exif, subsampling=0)

"""Convert one source file to upright 8-bit sRGB JPEGs without EXIF; measure their sharpness."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np
from msgspec.structs import replace

from walltopo.core import InputError
from walltopo.core.files import explain_full_disk
from walltopo.reconstruct.ingest.decoding import Done, MemoryBudget, StoredPhoto
from walltopo.reconstruct.ingest.image_file import (
    check_shape,
    decoded_photo,
    reduce_to,
    sharpness,
    thumbnail,
)
from walltopo.reconstruct.ingest.sources import is_video, still_of
from walltopo.reconstruct.ingest.video import sharpest_frames, video_seconds
from walltopo.reconstruct.settings import IngestSettings

if TYPE_CHECKING:
    from PIL.Image import Image


JPEG_QUALITY: Final = 95

_LIVE_SECONDS: Final = 3.5  # a Live Photo's video takes about 3 s


def store_file(
    number: int, file: Path, folder: Path, settings: IngestSettings, budget: MemoryBudget
) -> Done:
    """Decode one file and write its photos as `<number>.jpg` or `<number>_<frame>.jpg`.

    Raises
    ------
    EnvironmentLacksError : the disk is full.
    MemoryError : memory ran out although the file's header fitted the budget.
    """
    try:
        if is_video(file):
            if still_of(file) is not None and video_seconds(file) <= _LIVE_SECONDS:
                return Done(number, reasons=("the moving part of a Live Photo",))
            return _store_video(number, file, folder, settings, budget)
        with decoded_photo(file, settings, budget) as photo:
            stored = _store_photo(photo.image, folder / f"{number}.jpg", None, photo.focal_px)
            stored = replace(
                stored, source_pixels=photo.source_pixels, source_bytes=file.stat().st_size
            )
    except InputError as error:
        return Done(number, reasons=(error.message,))
    return Done(number, (stored,))


def _store_video(
    number: int, file: Path, folder: Path, settings: IngestSettings, budget: MemoryBudget
) -> Done:
    """Write the frames of a video, each at once, so that memory does not grow with its length."""
    from PIL import Image as Pil

    kept = _EvenlySpread(settings.video_max_frames)
    reasons: list[str] = []
    try:
        for frame in sharpest_frames(file, budget, reasons):
            if kept.wants_next():
                image = Pil.fromarray(frame.pixels)
                check_shape(image.size, settings)
                path = folder / f"{number}_{frame.number:06d}.jpg"
                image = reduce_to(image, settings.max_side)
                kept.add(_store_photo(image, path, frame.number), folder)
    except InputError as error:
        # The frames before the damage are as good as a shorter video.
        reasons.append(error.message)
    photos = kept.finish(folder)
    if not photos and not reasons:
        reasons.append("has no frames")
    return Done(number, photos, tuple(reasons))


class _EvenlySpread:
    """Keeps at most `max_` frames, spread evenly over a video of unknown length."""

    def __init__(self, max_: int) -> None:
        self.max_ = max_
        self._kept: list[StoredPhoto] = []
        self._offered, self._stride = 0, 1

    def wants_next(self) -> bool:
        """Return whether to keep the next frame: one of every `stride`, which doubles over time."""
        self._offered += 1
        return (self._offered - 1) % self._stride == 0

    def add(self, stored: StoredPhoto, folder: Path) -> None:
        """Keep a stored frame; drop every second one if there are too many."""
        self._kept.append(stored)
        if len(self._kept) > 2 * self.max_:
            self._keep(self._kept[::2], folder)
            self._stride *= 2

    def finish(self, folder: Path) -> tuple[StoredPhoto, ...]:
        """Drop surplus frames and return the kept ones."""
        if len(self._kept) > self.max_:
            chosen = np.linspace(0, len(self._kept) - 1, self.max_).round().astype(int)
            self._keep([self._kept[i] for i in chosen], folder)
        return tuple(self._kept)

    def _keep(self, chosen: list[StoredPhoto], folder: Path) -> None:
        names = {stored.file for stored in chosen}
        for stored in self._kept:
            if stored.file not in names:
                (folder / stored.file).unlink()
        self._kept = chosen


def _store_photo(
    image: Image, path: Path, frame: int | None, focal_px: float | None = None
) -> StoredPhoto:
    """Write an image as a JPEG and return its record."""
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    # Pillow's own file writing does not report a full disk.
    with explain_full_disk(path):
        path.write_bytes(stream.getbuffer())
    pixels = np.asarray(image, dtype=np.uint8)
    return StoredPhoto(
        path.name,
        frame,
        image.width,
        image.height,
        focal_px,
        sharpness(pixels),
        thumbnail(pixels).tobytes(),
        pixels.shape[0] * pixels.shape[1],
    )

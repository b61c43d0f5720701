"""One source file to JPEGs in a folder: upright 8-bit sRGB without EXIF, with their sharpness."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Final

import numpy as np

from walltopo.core import InputError
from walltopo.core.files import told_when_full
from walltopo.reconstruct.ingest.decode_job import Done, Stored
from walltopo.reconstruct.ingest.image_file import (
    check_shape,
    decoded_photo,
    reduce_to,
    sharpness,
    thumbnail,
)
from walltopo.reconstruct.ingest.memory_gate import Room
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo.reconstruct.ingest.sources import is_video
from walltopo.reconstruct.ingest.video import sharpest_frames

if TYPE_CHECKING:
    from PIL.Image import Image


_JPEG_QUALITY: Final = 95


def store_file(number: int, file: Path, folder: Path, settings: IngestSettings, room: Room) -> Done:
    """Decode one file and write its photos as `<number>.jpg` or `<number>_<frame>.jpg`.

    Raises
    ------
    EnvironmentLacksError : no space left.
    MemoryError : there was room by what the file says, and yet it ran out.
    """
    try:
        if is_video(file):
            return _store_video(number, file, folder, settings, room)
        with decoded_photo(file, settings, room) as photo:
            stored = _store(photo.image, folder / f"{number}.jpg", None, photo.focal_px)
    except InputError as error:
        return Done(number, reasons=(error.message,))
    return Done(number, (stored,))


def _store_video(
    number: int, file: Path, folder: Path, settings: IngestSettings, room: Room
) -> Done:
    """Each frame goes to disk at once, so that memory does not grow with the film."""
    from PIL import Image as Pil

    kept = _Thinned(settings.video_max_frames)
    reasons: list[str] = []
    try:
        for frame in sharpest_frames(file, room, reasons):
            if kept.wants_next():
                image = Pil.fromarray(frame.pixels)
                check_shape(image.size, settings)
                path = folder / f"{number}_{frame.number:06d}.jpg"
                image = reduce_to(image, settings.max_side)
                kept.add(_store(image, path, frame.number), folder)
    except InputError as error:
        # What was seen before the damage is as good as a shorter film.
        reasons.append(error.message)
    photos = kept.finish(folder)
    if not photos and not reasons:
        reasons.append("has no frames")
    return Done(number, photos, tuple(reasons))


class _Thinned:
    """At most `most` frames, spread evenly over a film whose length is not known in advance."""

    def __init__(self, most: int) -> None:
        self.most = most
        self._kept: list[Stored] = []
        self._seen, self._stride = 0, 1

    def wants_next(self) -> bool:
        """Whether the next frame is one of every `stride`, which doubles as the film goes on."""
        self._seen += 1
        return (self._seen - 1) % self._stride == 0

    def add(self, stored: Stored, folder: Path) -> None:
        self._kept.append(stored)
        if len(self._kept) > 2 * self.most:
            self._keep(self._kept[::2], folder)
            self._stride *= 2

    def finish(self, folder: Path) -> tuple[Stored, ...]:
        if len(self._kept) > self.most:
            chosen = np.linspace(0, len(self._kept) - 1, self.most).round().astype(int)
            self._keep([self._kept[i] for i in chosen], folder)
        return tuple(self._kept)

    def _keep(self, chosen: list[Stored], folder: Path) -> None:
        names = {stored.file for stored in chosen}
        for stored in self._kept:
            if stored.file not in names:
                (folder / stored.file).unlink()
        self._kept = chosen


def _store(image: Image, path: Path, frame: int | None, focal_px: float | None = None) -> Stored:
    """Write the JPEG."""
    stream = io.BytesIO()
    image.save(stream, "JPEG", quality=_JPEG_QUALITY, subsampling=0)
    # Pillow writing to a file itself does not say that the disk is full.
    with told_when_full(path):
        path.write_bytes(stream.getbuffer())
    pixels = np.asarray(image, dtype=np.uint8)
    return Stored(
        path.name,
        frame,
        image.width,
        image.height,
        focal_px,
        sharpness(pixels),
        thumbnail(pixels).tobytes(),
    )

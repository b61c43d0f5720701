"""The ingest stage: source files to `photos/` and `photos.json`."""

from __future__ import annotations

import re
import threading
import unicodedata
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.core.files import hash_path
from walltopo.photos.contract import IngestSettings, Reads, Writes
from walltopo.photos.image_file import decode_photo
from walltopo.photos.quality import sharpness, thumbnail
from walltopo.photos.sources import find_sources
from walltopo.photos.video import VIDEO_SUFFIXES, pick_frames
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photo_list import Photo, PhotoList, SkippedFile
from walltopo.scans.photo_set import PhotoSet

if TYPE_CHECKING:
    from PIL.Image import Image

__all__ = ["run"]

_FEWEST = 3
_JPEG_QUALITY = 95
# A photo is blurred below this variance of its Laplacian at 1024 px, and below this share of the
# set's median.
_LEAST_SHARPNESS = 3.0
_LEAST_SHARPNESS_SHARE = 0.04
# Mean grey difference (of 255) under which two photos show the same.
_SAME_DIFFERENCE = 0.6


@dataclass(frozen=True)
class _Photo:
    """A decoded candidate, already written under `name` in the temporary folder."""

    name: str
    source: str
    width: int
    height: int
    focal_px: float | None
    sharpness: float
    thumbnail: NDArray[np.float32]

    def listed(self) -> Photo:
        """Its entry in `photos.json`."""
        focal_px = None if self.focal_px is None else round(self.focal_px, 2)
        return Photo(
            self.name, self.width, self.height, focal_px, self.source, round(self.sharpness, 2)
        )


def run(reads: Reads, settings: IngestSettings, context: Context) -> Writes:
    """Decode, check and store the photos: upright 8-bit sRGB JPEG without EXIF.

    Raises
    ------
    InputError : nothing to read, or fewer than 3 usable photos (with every reason).
    """
    files, others = find_sources(reads.sources)
    skipped = [SkippedFile(file.name, "neither a photo nor a video") for file in others]
    folder = context.scratch / "photos"
    folder.mkdir()
    photos: list[_Photo] = []
    for item in _decode_all(files, folder, settings, context.progress):
        if isinstance(item, _Photo):
            photos.append(item)
        else:
            skipped.append(item)
    photos, rejected = _select(photos)
    skipped += rejected
    if len(photos) < _FEWEST:
        raise InputError(_too_few(photos, skipped), "Add photos of the wall and run again.")
    kept = {photo.name for photo in photos}
    for file in folder.iterdir():
        if file.name not in kept:
            file.unlink()
    for item in skipped:
        context.progress.note(f"skipped {item.source}: {item.reason}")
    metrics: Metrics = {
        "photos": len(photos),
        "skipped": len(skipped),
        "sizes": len({(photo.width, photo.height) for photo in photos}),
        "focal": sum(photo.focal_px is not None for photo in photos),
    }
    listed = PhotoList(photos=tuple(photo.listed() for photo in photos), skipped=tuple(skipped))
    return Writes(PhotoSet(folder), listed, metrics)


def _decode_all(
    files: Sequence[Path], folder: Path, settings: IngestSettings, progress: Progress
) -> Iterator[_Photo | SkippedFile]:
    """Candidates in the order of the sources; decoding runs on several threads."""
    names = _Names()
    jobs = _with_twins(files)
    progress.step("read photos", len(files))
    with ThreadPoolExecutor(max_workers=4) as pool:

        def decode(job: tuple[Path, str | None]) -> list[_Photo | SkippedFile]:
            file, twin = job
            if twin is not None:
                return [SkippedFile(file.name, f"the same file as {twin}")]
            try:
                if file.suffix.lower() in VIDEO_SUFFIXES:
                    return _from_video(file, folder, settings, names)
                photo = decode_photo(file)
                return [_store(photo.image, photo.focal_px, file, folder, settings, names)]
            except InputError as error:
                return [SkippedFile(file.name, error.message)]

        # Names are given in advance so that the threads' order cannot change them.
        for file, twin in jobs:
            if twin is None:
                names.reserve(file)
        for results in pool.map(decode, jobs):
            progress.advance()
            yield from results


def _with_twins(files: Sequence[Path]) -> list[tuple[Path, str | None]]:
    """Each file with the name of an earlier one of the same content, or None."""
    sizes = Counter(file.stat().st_size for file in files)
    seen: dict[str, str] = {}
    jobs: list[tuple[Path, str | None]] = []
    for file in files:
        # Files of different sizes differ: hardly any needs to be read twice.
        content = hash_path(file) if sizes[file.stat().st_size] > 1 else str(file)
        jobs.append((file, seen.get(content)))
        seen.setdefault(content, file.name)
    return jobs


def _from_video(
    file: Path, folder: Path, settings: IngestSettings, names: _Names
) -> list[_Photo | SkippedFile]:
    from PIL import Image as Pil

    frames = pick_frames(file, settings)
    return [
        _store(Pil.fromarray(pixels), None, file.with_name(name), folder, settings, names)
        for name, pixels in frames
    ]


def _store(
    image: Image,
    focal_px: float | None,
    file: Path,
    folder: Path,
    settings: IngestSettings,
    names: _Names,
) -> _Photo | SkippedFile:
    """Check size and shape, reduce, write the JPEG."""
    short, long = sorted(image.size)
    if short < settings.min_side:
        return SkippedFile(
            file.name, f"{image.width}x{image.height} px, smaller than {settings.min_side} px"
        )
    if long / short > settings.max_aspect:
        return SkippedFile(
            file.name, f"{image.width}x{image.height} px, a panorama; it has no single camera"
        )
    if long > settings.max_side:
        factor = settings.max_side / long
        image = image.resize((round(image.width * factor), round(image.height * factor)))
        focal_px = focal_px * factor if focal_px is not None else None
    name = names.of(file)
    image.save(folder / name, "JPEG", quality=_JPEG_QUALITY, subsampling=0)
    pixels = np.asarray(image, dtype=np.uint8)
    return _Photo(
        name,
        file.name,
        image.width,
        image.height,
        focal_px,
        sharpness(pixels),
        thumbnail(pixels),
    )


def _select(photos: Sequence[_Photo]) -> tuple[list[_Photo], list[SkippedFile]]:
    """Leave out the blurred and the repeated."""
    kept: list[_Photo] = []
    rejected: list[SkippedFile] = []
    median = float(np.median([photo.sharpness for photo in photos])) if photos else 0.0
    least = max(_LEAST_SHARPNESS, _LEAST_SHARPNESS_SHARE * median)
    for photo in photos:
        twin = next((k for k in kept if _same(k, photo)), None)
        if photo.sharpness < least:
            reason = f"blurred (sharpness {photo.sharpness:.1f}, the set's median {median:.0f})"
            rejected.append(SkippedFile(photo.source, reason))
        elif twin is not None:
            rejected.append(SkippedFile(photo.source, f"shows the same as {twin.source}"))
        else:
            kept.append(photo)
    return kept, rejected


def _same(a: _Photo, b: _Photo) -> bool:
    if (a.width > a.height) != (b.width > b.height):
        return False
    return float(np.abs(a.thumbnail - b.thumbnail).mean()) < _SAME_DIFFERENCE


def _too_few(photos: Sequence[_Photo], skipped: Sequence[SkippedFile]) -> str:
    noun = "photo" if len(photos) == 1 else "photos"
    lines = [f"{len(photos)} usable {noun}, at least {_FEWEST} are needed"]
    lines += [f"  {item.source}: {item.reason}" for item in skipped[:20]]
    if len(skipped) > 20:
        lines.append(f"  ... and {len(skipped) - 20} more")
    return "\n".join(lines)


class _Names:
    """File names for the stored photos: the source's own, made safe and unique."""

    def __init__(self) -> None:
        self._by_file: dict[Path, str] = {}
        self._taken: set[str] = set()
        self._lock = threading.Lock()

    def reserve(self, file: Path) -> str:
        stem = unicodedata.normalize("NFC", file.stem)
        stem = re.sub(r"[^\w.-]+", "_", stem).strip("._") or "photo"
        name, number = f"{stem}.jpg", 2
        with self._lock:
            while name.lower() in self._taken:
                name, number = f"{stem}_{number}.jpg", number + 1
            self._taken.add(name.lower())
            self._by_file[file] = name
        return name

    def of(self, file: Path) -> str:
        return self._by_file.get(file) or self.reserve(file)

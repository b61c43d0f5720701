"""Choose the photos of a scan: decode all sources, leave out blurred and repeated ones."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.reconstruct.ingest.decode_job import Done, Stored
from walltopo.reconstruct.ingest.decoding import decode_files
from walltopo.reconstruct.ingest.image_file import LEAST_SHARPNESS
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo.reconstruct.ingest.sources import Names, is_video, shown_name
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList, PhotoSet, SkippedFile
from walltopo.scans.sources import SourceList

_FEWEST = 3
# A photo is blurred below `LEAST_SHARPNESS`, and below this share of the set's median.
_LEAST_SHARPNESS_SHARE = 0.04
# Mean grey difference (of 255) under which two photos show the same.
_SAME_DIFFERENCE = 0.6


@dataclass(frozen=True)
class _Photo:
    """A decoded candidate: it lies at `file` and will be called `name`."""

    file: Path
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


def select_photos(
    sources: SourceList, settings: IngestSettings, context: Context
) -> tuple[PhotoSet, PhotoList, Metrics]:
    """Decode, check and store the photos: upright 8-bit sRGB JPEG without EXIF.

    Raises
    ------
    InputError : nothing to read, or fewer than 3 usable photos (with every reason).
    """
    skipped = list(sources.skipped)
    decoded = context.scratch / "decoded"
    decoded.mkdir()
    photos: list[_Photo] = []
    for item in _decode_all(sources, decoded, settings, context.progress):
        if isinstance(item, _Photo):
            photos.append(item)
        else:
            skipped.append(item)
    photos, rejected = _select(photos)
    skipped += rejected
    if len(photos) < _FEWEST:
        raise InputError(_too_few(photos, skipped), "Add photos of the wall and run again.")
    folder = context.scratch / "photos"
    folder.mkdir()
    for photo in photos:
        photo.file.rename(folder / photo.name)
    for item in skipped:
        context.progress.note(f"skipped {item.source}: {item.reason}")
    metrics: Metrics = {
        "photos": len(photos),
        "skipped": len(skipped),
        "sizes": len({(photo.width, photo.height) for photo in photos}),
        "focal": sum(photo.focal_px is not None for photo in photos),
    }
    listed = PhotoList(photos=tuple(photo.listed() for photo in photos), skipped=tuple(skipped))
    return PhotoSet(folder), listed, metrics


def _decode_all(
    sources: SourceList, folder: Path, settings: IngestSettings, progress: Progress
) -> Iterator[_Photo | SkippedFile]:
    """Yield candidates in the order of the sources, whatever was decoded first."""
    files = [source.file for source in sources.files]
    twins = _twins(sources)
    jobs = [(number, file) for number, file in enumerate(files) if number not in twins]
    progress.step("read photos", len(jobs))
    done: dict[int, Done] = {}
    with closing(decode_files(jobs, folder, settings, progress)) as answers:
        for answer in answers:
            done[answer.number] = answer
            progress.advance()
    names = Names()
    # Photos have the first choice of names, frames of videos the second.
    first = {number: names.give(file.stem) for number, file in jobs if not is_video(file)}
    for number, file in enumerate(files):
        source = shown_name(file)
        if number in twins:
            yield SkippedFile(source, f"the same file as {twins[number]}")
            continue
        for reason in done[number].reasons:
            yield SkippedFile(source, reason)
        for stored in done[number].photos:
            if stored.frame is None:
                yield _photo(stored, folder, first[number], source)
            else:
                end = f"_{stored.frame:06d}"
                shown = shown_name(file.with_suffix("")) + end
                yield _photo(stored, folder, names.give(file.stem, end), shown)


def _twins(sources: SourceList) -> dict[int, str]:
    """Return the number of each file that repeats an earlier one, with the earlier one's name."""
    first: dict[str, str] = {}
    twins: dict[int, str] = {}
    for number, source in enumerate(sources.files):
        if source.content in first:
            twins[number] = first[source.content]
        first.setdefault(source.content, shown_name(source.file))
    return twins


def _photo(stored: Stored, folder: Path, name: str, source: str) -> _Photo:
    return _Photo(
        folder / stored.file,
        name,
        source,
        stored.width,
        stored.height,
        stored.focal_px,
        stored.sharpness,
        np.frombuffer(stored.thumbnail, dtype=np.float32),
    )


def _select(photos: Sequence[_Photo]) -> tuple[list[_Photo], list[SkippedFile]]:
    """Leave out the blurred and the repeated."""
    kept: list[_Photo] = []
    rejected: list[SkippedFile] = []
    median = float(np.median([photo.sharpness for photo in photos])) if photos else 0.0
    least = max(LEAST_SHARPNESS, _LEAST_SHARPNESS_SHARE * median)
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

"""Choose the photos of a scan: decode all sources, skip blurred and repeated photos."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress
from walltopo.reconstruct.ingest.decoding import Done, StoredPhoto, decode_files
from walltopo.reconstruct.ingest.image_file import MIN_SHARPNESS
from walltopo.reconstruct.ingest.sources import Names, is_video, shown_name
from walltopo.reconstruct.settings import IngestSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList, PhotoSet, SkippedFile, SourceList

_MIN_PHOTOS = 3
# A photo is also blurred if its sharpness is below this share of the set's median.
_MIN_SHARPNESS_SHARE = 0.04
# Mean grey difference (of 255) below which two photos count as equal.
_SAME_DIFFERENCE = 0.6


@dataclass(frozen=True)
class _Photo:
    """A decoded candidate, stored at `file`; its name in the scan will be `name`."""

    file: Path
    name: str
    source: str
    width: int
    height: int
    focal_px: float | None
    sharpness: float
    thumbnail: NDArray[np.float32]
    source_pixels: int
    source_bytes: int

    @property
    def quality(self) -> tuple[int, bool, int]:
        """Return a key that is greater for the better picture of one view: larger, with a focal
        length, less compressed."""
        return self.source_pixels, self.focal_px is not None, self.source_bytes

    def listed(self) -> Photo:
        """Return the entry in `photos.json`."""
        focal_px = None if self.focal_px is None else round(self.focal_px, 2)
        return Photo(
            self.name, self.width, self.height, focal_px, self.source, round(self.sharpness, 2)
        )


def select_photos(
    sources: SourceList, settings: IngestSettings, context: Context
) -> tuple[PhotoSet, PhotoList, Metrics]:
    """Decode, check and store the photos as upright 8-bit sRGB JPEGs without EXIF.

    Raises
    ------
    InputError : fewer than 3 usable photos; the message lists why files were skipped.
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
    photos, rejected = _select_photos(photos)
    skipped += rejected
    if len(photos) < _MIN_PHOTOS:
        raise InputError(_too_few(photos, skipped), "Add photos of the wall and run again.")
    folder = context.scratch / "photos"
    folder.mkdir()
    for photo in photos:
        photo.file.rename(folder / photo.name)
    with_people = 0
    if settings.hide_people:
        from walltopo.reconstruct.ingest.people import hide_in_photos

        names = [photo.name for photo in photos]
        with_people = hide_in_photos(folder, names, context.progress)
    for note in _skip_notes(skipped):
        context.progress.note(note)
    metrics: Metrics = {
        "photos": len(photos),
        "skipped": len(skipped),
        "sizes": len({(photo.width, photo.height) for photo in photos}),
        "focal": sum(photo.focal_px is not None for photo in photos),
        "with_people": with_people,
    }
    listed = PhotoList(photos=tuple(photo.listed() for photo in photos), skipped=tuple(skipped))
    return PhotoSet(folder), listed, metrics


_MAX_NOTES = 3  # of one reason; more files share one line


def _skip_notes(skipped: Sequence[SkippedFile]) -> Iterator[str]:
    """Yield a line for each skipped file, or one for many files of one reason."""
    by_reason: dict[str, list[str]] = {}
    for item in skipped:
        by_reason.setdefault(item.reason, []).append(item.source)
    for reason, names in by_reason.items():
        if len(names) > _MAX_NOTES:
            yield f"skipped {len(names)} files ({names[0]} to {names[-1]}): {reason}"
        else:
            yield from (f"skipped {name}: {reason}" for name in names)


def _decode_all(
    sources: SourceList, folder: Path, settings: IngestSettings, progress: Progress
) -> Iterator[_Photo | SkippedFile]:
    """Yield candidates in the order of the sources, independent of the decoding order."""
    files = [source.file for source in sources.files]
    duplicates = _find_duplicates(sources)
    jobs = [(number, file) for number, file in enumerate(files) if number not in duplicates]
    progress.step("read photos", len(jobs))
    done: dict[int, Done] = {}
    with closing(decode_files(jobs, folder, settings, progress)) as results:
        for result in results:
            done[result.number] = result
            progress.advance()
    names = Names()
    # Photos get their names first, so that video frames never change a photo's name.
    names_of_photos = {
        number: names.assign(file.stem) for number, file in jobs if not is_video(file)
    }
    for number, file in enumerate(files):
        source = shown_name(file)
        if number in duplicates:
            yield SkippedFile(source, f"the same file as {duplicates[number]}")
            continue
        for reason in done[number].reasons:
            yield SkippedFile(source, reason)
        for stored in done[number].photos:
            if stored.frame is None:
                yield _photo(stored, folder, names_of_photos[number], source)
            else:
                end = f"_{stored.frame:06d}"
                shown = shown_name(file.with_suffix("")) + end
                yield _photo(stored, folder, names.assign(file.stem, end), shown)


def _find_duplicates(sources: SourceList) -> dict[int, str]:
    """Return the number of each duplicate file with the name of the earlier file."""
    names_of_photos: dict[str, str] = {}
    duplicates: dict[int, str] = {}
    for number, source in enumerate(sources.files):
        if source.content in names_of_photos:
            duplicates[number] = names_of_photos[source.content]
        names_of_photos.setdefault(source.content, shown_name(source.file))
    return duplicates


def _photo(stored: StoredPhoto, folder: Path, name: str, source: str) -> _Photo:
    return _Photo(
        folder / stored.file,
        name,
        source,
        stored.width,
        stored.height,
        stored.focal_px,
        stored.sharpness,
        np.frombuffer(stored.thumbnail, dtype=np.float32),
        stored.source_pixels,
        stored.source_bytes,
    )


def _select_photos(photos: Sequence[_Photo]) -> tuple[list[_Photo], list[SkippedFile]]:
    """Separate the photos to keep from the blurred and the repeated.

    The best of several pictures of one view is kept, under the name of the first. If it has no
    focal length, it gets that of another one.
    """
    kept: list[_Photo] = []
    rejected: list[SkippedFile] = []
    copies: list[tuple[str, int]] = []  # source, and the index in `kept` of the better picture
    median = float(np.median([photo.sharpness for photo in photos])) if photos else 0.0
    min_sharpness = max(MIN_SHARPNESS, _MIN_SHARPNESS_SHARE * median)
    for photo in photos:
        twin = next((k for k, one in enumerate(kept) if _same_picture(one, photo)), None)
        if photo.sharpness < min_sharpness:
            reason = f"blurred (sharpness {photo.sharpness:.1f}, the set's median {median:.0f})"
            rejected.append(SkippedFile(photo.source, reason))
        elif twin is not None:
            first = kept[twin]
            best, other = sorted((first, photo), key=lambda one: one.quality, reverse=True)
            kept[twin] = replace(best, name=first.name, focal_px=_focal_of_view(best, other))
            copies.append((other.source, twin))
        else:
            kept.append(photo)
    rejected += [
        SkippedFile(source, f"shows the same as {kept[twin].source}") for source, twin in copies
    ]
    return kept, rejected


def _focal_of_view(best: _Photo, other: _Photo) -> float | None:
    """Return the focal length in pixels of `best`, if necessary from another picture of the view.

    A file without EXIF may be a copy of one with it.
    """
    if best.focal_px is not None or other.focal_px is None:
        return best.focal_px
    return other.focal_px * max(best.width, best.height) / max(other.width, other.height)


def _same_picture(a: _Photo, b: _Photo) -> bool:
    if (a.width > a.height) != (b.width > b.height):
        return False
    return float(np.abs(a.thumbnail - b.thumbnail).mean()) < _SAME_DIFFERENCE


def _too_few(photos: Sequence[_Photo], skipped: Sequence[SkippedFile]) -> str:
    noun = "photo" if len(photos) == 1 else "photos"
    lines = [f"{len(photos)} usable {noun}, at least {_MIN_PHOTOS} are needed"]
    lines += [f"  {item.source}: {item.reason}" for item in skipped[:20]]
    if len(skipped) > 20:
        lines.append(f"  ... and {len(skipped) - 20} more")
    return "\n".join(lines)

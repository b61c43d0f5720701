"""Hide the people in the photos of a scan, and list where they stood."""

from __future__ import annotations

import io
from collections.abc import Sequence
from pathlib import Path

from walltopo.core import Progress
from walltopo.core.files import explain_full_disk
from walltopo.core.parallel import map_ahead
from walltopo.images.files import read_rgb
from walltopo.images.fill import hide_pixels
from walltopo.images.people import find_people, people_mask
from walltopo.reconstruct.ingest.store import JPEG_QUALITY
from walltopo.scans.people import PEOPLE, HiddenPeople, PeopleList


def hide_in_photos(folder: Path, names: Sequence[str], progress: Progress) -> int:
    """Hide the people in the photos of a folder; return the number of photos that showed any.

    Photos without people stay as they are. The places of people are written to `people.json`
    beside the photos; nothing is written if no photo shows anyone.
    """
    progress.step("hide people", len(names))
    found: list[HiddenPeople] = []
    for entry in map_ahead(lambda name: _hide_people_in(folder / name), names):
        if entry is not None:
            found.append(entry)
            progress.detail(f"{entry.photo}: {entry.people} people")
        progress.advance()
    if found:
        PeopleList(photos=tuple(found)).save(folder / PEOPLE)
    return len(found)


def _hide_people_in(path: Path) -> HiddenPeople | None:
    """Hide the people in one photo; return None if it shows nobody."""
    from PIL import Image

    photo = read_rgb(path)
    people = find_people(photo)
    if not people:
        return None
    mask = people_mask(photo, people)
    stream = io.BytesIO()
    hidden = Image.fromarray(hide_pixels(photo, mask))
    hidden.save(stream, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    with explain_full_disk(path):
        path.write_bytes(stream.getbuffer())
    return HiddenPeople.of(path.name, len(people), mask)

"""Messages of the editor: the result of a log, the status of a rebuild, photos of a place."""

from __future__ import annotations

import msgspec

from walltopo.scans.document import Count
from walltopo.scans.hidden import HiddenPlace
from walltopo.scans.holds import Hold
from walltopo.scans.page_labels import SurfaceLabels
from walltopo.scans.routes import Route


class ShownHold(Hold, frozen=True):
    """A row of `holds.json`, or a low-confidence instance.

    Parameters
    ----------
    cutout : picture as a `data:` URL, if an edit remeasured the hold in photos.
    """

    cutout: str = ""


class EditResult(msgspec.Struct, frozen=True):
    """The scan after a log of edits.

    Parameters
    ----------
    holds : in the order of ids, including low-confidence instances.
    routes : from left to right, new ones last.
    surface : labels of the mesh, relative to the patches of the page's tiers.
    hidden : places that are hidden in texture and photos.
    notes : entries that were skipped, with the reason.
    """

    holds: tuple[ShownHold, ...]
    routes: tuple[Route, ...]
    surface: SurfaceLabels
    hidden: tuple[HiddenPlace, ...]
    notes: tuple[Note, ...]


class RebuildStatus(msgspec.Struct, frozen=True):
    """The progress of the files that follow from the log.

    Parameters
    ----------
    stale : the scan's files do not match the saved log.
    running : a rebuild is in progress.
    done_version : version of the log that the files match; empty if unknown.
    problem : why the rebuild failed, in English; empty otherwise.
    key : `problem_key` of the problem, for a page in another language; empty without a key.
    """

    stale: bool
    running: bool
    done_version: str
    problem: str
    key: str = ""


class Crop(msgspec.Struct, frozen=True):
    """A crop of a photo around a place of the wall.

    Parameters
    ----------
    photo : name of the photo.
    picture : as a `data:` URL.
    x, y : the place, as shares of the picture's width and height.
    """

    photo: str
    picture: str
    x: float
    y: float


# Why an entry was skipped, in English; numbers go into the braces.
REASONS = {
    "hold_gone": "hold {} no longer exists",
    "route_gone": "route {} no longer exists",
    "other_route": "hold {} is no longer in route {}",
    "volume": "hold {} is a volume, which belongs to every route",
    "routes_one": "routes {} are already one",
    "holds_one": "holds {} are already one",
    "no_line": "the line of the cut has no length",
    "beside": "the line does not cross hold {}",
    "no_wall": "there is no wall around this place",
    "not_hidden": "nothing is hidden at this place",
    "no_surface": "there is no free surface at this place",
    "no_volume": "nothing of a volume's size stands out of the wall at this place",
}
LISTS = {"routes_one", "holds_one"}  # reasons with one pair of braces for all numbers


class MissingError(Exception):
    """An entry refers to something that does not exist.

    Parameters
    ----------
    reason : a key of `REASONS`; numbers : of the holds and routes in it.
    """

    def __init__(self, reason: str, *numbers: int) -> None:
        super().__init__(reason, *numbers)
        self.reason = reason
        self.numbers = numbers

    def __str__(self) -> str:
        if self.reason in LISTS:
            return REASONS[self.reason].format(", ".join(map(str, self.numbers)))
        return REASONS[self.reason].format(*self.numbers)


class Note(msgspec.Struct, frozen=True):
    """An entry of the log that was skipped.

    Parameters
    ----------
    entry : number of the entry in the log, from 1; do : kind of the entry.
    reason : a key of `REASONS`; numbers : of the holds and routes in it.
    text : the full text in English, for the terminal.
    """

    entry: Count
    do: str
    reason: str
    numbers: tuple[int, ...]
    text: str

    @classmethod
    def of(cls, entry: int, do: str, why: MissingError) -> Note:
        """Return the note of an entry that failed."""
        text = f"edit {entry} ({do}) was skipped: {why}"
        return cls(entry, do, why.reason, why.numbers, text)

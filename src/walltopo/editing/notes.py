"""What could not be applied, as a reason with numbers: a page says it in its own language."""

from __future__ import annotations

import msgspec

from walltopo.scans.document import Count

# Why an entry changes nothing, in English; numbers go into the braces.
REASONS = {
    "hold_gone": "hold {} is not there any more",
    "route_gone": "route {} is not there any more",
    "other_route": "hold {} is not of route {} any more",
    "volume": "hold {} is a volume, which belongs to every route",
    "routes_one": "routes {} are one already",
    "holds_one": "holds {} are one already",
    "no_line": "the line of the cut has no length",
    "beside": "the line does not cross hold {}",
    "no_wall": "there is no wall around this place",
    "no_surface": "there is no free surface at this place",
}
LISTS = {"routes_one", "holds_one"}  # all numbers go into one pair of braces


class MissingError(Exception):
    """What an entry means is not there.

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
    """An entry of the log that was left out.

    Parameters
    ----------
    entry : its number in the log, from 1; do : its kind.
    reason : a key of `REASONS`; numbers : of the holds and routes in it.
    text : all of it in English, for the terminal.
    """

    entry: Count
    do: str
    reason: str
    numbers: tuple[int, ...]
    text: str

    @classmethod
    def of(cls, entry: int, do: str, why: MissingError) -> Note:
        """Of the entry that failed."""
        text = f"edit {entry} ({do}) was left out: {why}"
        return cls(entry, do, why.reason, why.numbers, text)

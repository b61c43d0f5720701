"""Numbers and names as files may have them: bounded, so that arrays and sums of them hold."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Annotated

import msgspec

from walltopo.core import InputError
from walltopo.core.picture_size import MOST_SIDE

__all__ = [
    "Coordinate",
    "Count",
    "FileName",
    "Label",
    "Level",
    "Rgb",
    "Share",
    "Side",
    "check_once",
]

Label = Annotated[int, msgspec.Meta(ge=0, le=2**31 - 1)]  # an id as arrays hold it; 0 = none
Count = Annotated[int, msgspec.Meta(ge=0, le=2**62)]
Level = Annotated[int, msgspec.Meta(ge=0, le=255)]
Share = Annotated[float, msgspec.Meta(ge=0, le=1)]
Side = Annotated[int, msgspec.Meta(ge=1, le=MOST_SIDE)]  # of a picture, pixels
Rgb = tuple[Level, Level, Level]  # sRGB
# No wall reaches so far, and squares of it are still exact enough.
Coordinate = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
# The class that has one calls `check_name` on it.
FileName = Annotated[str, msgspec.Meta(min_length=1, extra={"is": "file name"})]


def check_once(what: str, values: Iterable[Hashable]) -> None:
    """Refuse a value that occurs twice; InputError names it."""
    seen: set[Hashable] = set()
    for value in values:
        if value in seen:
            raise InputError(f"{what} {value} occurs twice")
        seen.add(value)

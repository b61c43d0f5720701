"""Fields of request bodies with their bounds."""

from __future__ import annotations

import re
import unicodedata
from datetime import UTC, date, datetime
from typing import Annotated, Any, Final

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    StringConstraints,
    model_validator,
)

from walltopo_gym.texts import UNPRINTABLE, one_line

# Printable, of one line: no control or bidirectional override characters, no lone surrogates.
_LINE: Final = rf"^[^{UNPRINTABLE}]+$"
_LINE_OR_EMPTY: Final = rf"^[^{UNPRINTABLE}]*$"
_UNPRINTABLE: Final = re.compile(f"[{UNPRINTABLE}]")

_MAX_DEPTH: Final = 20  # no body is nested deeper; what is, is refused by its fields


def normalise_text(value: Any, depth: int = 0) -> Any:
    """Return plain values with all of their text in Unicode's form NFC."""
    if isinstance(value, str):
        return unicodedata.normalize("NFC", value)
    if depth > _MAX_DEPTH:
        return value
    if isinstance(value, dict):
        return {
            normalise_text(key, depth): normalise_text(item, depth + 1)
            for key, item in value.items()
        }
    if isinstance(value, list):
        return [normalise_text(item, depth + 1) for item in value]
    return value


def _as_one_line(given: Any) -> Any:
    """Return a printable text in its normal form of one line; leave others to be refused."""
    if isinstance(given, str) and not _UNPRINTABLE.search(given):
        return one_line(given)
    return given


Name = Annotated[
    str,
    BeforeValidator(_as_one_line),
    StringConstraints(min_length=1, max_length=80, pattern=_LINE),
]
Text = Annotated[
    str,
    BeforeValidator(_as_one_line),
    StringConstraints(max_length=120, pattern=_LINE_OR_EMPTY),
]
# `Text` with its own limit: a `Field` can only lower it.
Note = Annotated[
    str,
    BeforeValidator(_as_one_line),
    StringConstraints(max_length=300, pattern=_LINE_OR_EMPTY),
]
# Words of several lines: no control characters but tabs and line breaks.
LongText = r"^[^\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069]*$"
Slug = Annotated[str, Field(pattern=r"^[a-z0-9]+(-[a-z0-9]+)*$", max_length=60)]
Secret = Annotated[str, Field(min_length=20, max_length=100)]


def _only_digits(given: Any) -> Any:
    """Refuse what Python reads as a number besides digits: "+5", "1_0", "5.0", " 5".

    Raises
    ------
    ValueError : says what is expected.
    """
    if isinstance(given, str) and re.fullmatch("[0-9]+", given) is None:
        raise ValueError("expected digits from 0 to 9")
    return given


# A number in a header, a path or a query.
Digits = Annotated[int, BeforeValidator(_only_digits)]
Revision = Annotated[int, Field(ge=0, le=2_000_000_000)]

_FIRST: Final = datetime(1900, 1, 1, tzinfo=UTC)
_END: Final = datetime(2200, 1, 1, tzinfo=UTC)


def _in_calendar(moment: datetime) -> datetime:
    """Refuse a moment that no time zone and no calendar file can express.

    Raises
    ------
    ValueError : names the accepted moments.
    """
    if not _FIRST <= moment < _END:
        raise ValueError("expected a moment from 1900 to 2199")
    return moment


Moment = Annotated[AwareDatetime, AfterValidator(_in_calendar)]


def _day_in_calendar(day: date) -> date:
    """Refuse a day outside of the years of `Moment`.

    Raises
    ------
    ValueError : names the accepted days.
    """
    if not _FIRST.date() <= day < _END.date():
        raise ValueError("expected a day from 1900 to 2199")
    return day


Day = Annotated[date, AfterValidator(_day_in_calendar)]


class Body(BaseModel):
    """Base of all request bodies. Unknown fields are refused; text gets Unicode's form NFC.

    macOS and some Android keyboards send letters and their accents apart (NFD); a name or a
    password would then not equal itself.
    """

    model_config = ConfigDict(extra="forbid")

    @model_validator(mode="before")
    @classmethod
    def _composed(cls, given: Any) -> Any:
        return normalise_text(given)


class Complaint(Body):
    """The reason of a report; may be empty."""

    reason: Note = Field("", max_length=200)

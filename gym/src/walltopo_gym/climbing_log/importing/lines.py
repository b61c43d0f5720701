"""The lines of an imported log, and the parts of their fields that all sources share."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import UTC, date, datetime
from typing import Any, Final

from walltopo_gym.climbing.kinds import FIRST_TRIES
from walltopo_gym.climbing_log.models import MAX_GRADE, MAX_NAME, MAX_NOTE
from walltopo_gym.climbing_log.other import (
    Discipline,
    OtherClimb,
    OtherKind,
    Venue,
    latest_day,
    noon_of,
)
from walltopo_gym.errors import RequestError
from walltopo_gym.spreadsheets import MAX_SHOWN, Fault
from walltopo_gym.texts import blank_unprintable, printable

MAX_TRIES: Final = 999
_FIRST_DAY: Final = date(1900, 1, 1)
_NAMES: Final = "jan feb mar apr may jun jul aug sep oct nov dec"
_MONTHS: Final = {name: number for number, name in enumerate(_NAMES.split(), 1)}


@dataclass(frozen=True)
class LogLine(OtherClimb):
    """A climb of an imported file.

    Parameters
    ----------
    number : its line in a table, or its position in a document; both from 1.
    key : what tells the line apart in its source; the same in every export.
    is_shortened : whether a text was longer than a log keeps.
    """

    number: int
    key: str
    is_shortened: bool


@dataclass(frozen=True)
class LogFile:
    """The content of an imported file: climbs in the file's order, and lines with errors.

    Parameters
    ----------
    source : "8a.nu", "theCrag", "board", "MoonBoard", "TopLogger" or "walltopo".
    """

    source: str
    lines: list[LogLine]
    faults: list[Fault]


@dataclass(frozen=True)
class RawLine:
    """A climb in the words of its source; `make_line` checks it.

    Parameters
    ----------
    day : as `parse_day` reads it. tries : a number, or empty for an unknown one.
    kind : None for a style that no log knows; `style` is its name there.
    """

    number: int
    venue: Venue
    name: str
    location: str
    grade: str
    kind: OtherKind | None
    style: str
    tries: str
    day: str
    discipline: Discipline = ""
    note: str = ""
    key: str = ""


def make_line(raw: RawLine) -> LogLine | Fault:
    """Return the climb of a line, or why it cannot be read."""
    if raw.kind is None:
        return Fault(raw.number, "", _error("log-style", "log-style-skip", raw.style))
    climbed_at = parse_day(raw.day)
    if climbed_at is None:
        return Fault(raw.number, "", _error("log-day", "log-day-form", raw.day))
    if not _FIRST_DAY <= climbed_at.date() <= latest_day():
        return Fault(raw.number, "", _error("log-day-range", "log-day-form", raw.day))
    name, location = printable(raw.name), printable(raw.location)
    grade, note = printable(raw.grade), _printable_note(raw.note)
    long = any(
        len(text) > most
        for text, most in (
            (name, MAX_NAME),
            (location, MAX_NAME),
            (grade, MAX_GRADE),
            (note, MAX_NOTE),
        )
    )
    fields = raw.venue, raw.discipline, name, location, grade, raw.kind, raw.day
    return LogLine(
        number=raw.number,
        venue=raw.venue,
        discipline=raw.discipline,
        name=_shorten_text(name, MAX_NAME),
        location=_shorten_text(location, MAX_NAME),
        grade=_shorten_text(grade, MAX_GRADE),
        kind=raw.kind,
        tries=1 if raw.kind in FIRST_TRIES else _parse_tries(raw.tries),
        note=_shorten_text(note, MAX_NOTE),
        climbed_at=climbed_at,
        key=raw.key or "\n".join(fields),
        is_shortened=long,
    )


def parse_day(text: str) -> datetime | None:
    """Return the moment of "2024-06-17", "2024-06-17 16:21:23", "2024-06-17T16:21:23Z" or
    "05 Sep 2023"; noon UTC without a time, None for other texts.

    A time without a zone counts as UTC, so that the day stays that of the file.
    """
    text = text.strip()
    named = re.fullmatch(r"(\d{1,2}) ([A-Za-z]{3})[a-z]* (\d{4})", text)
    try:
        if named is not None:
            month = _MONTHS.get(named[2].lower(), 0)
            return noon_of(date(int(named[3]), month, int(named[1])))
        if re.fullmatch(r"\d{4}-\d{2}-\d{2}", text):
            return noon_of(date.fromisoformat(text))
        found = datetime.fromisoformat(text)
        moment = found.replace(tzinfo=UTC) if found.tzinfo is None else found.astimezone(UTC)
    except (ValueError, OverflowError):
        return None
    midnight = (moment.hour, moment.minute, moment.second) == (0, 0, 0)
    return noon_of(moment.date()) if midnight else moment


def text_of(row: Mapping[str, Any], *names: str) -> str:
    """Return the first of these fields that is not empty, as text; "null" counts as empty."""
    for name in names:
        value = row.get(name)
        text = "" if value is None else str(value).strip()
        if text and text.lower() != "null":
            return text
    return ""


def _parse_tries(text: str) -> int:
    """Return a number of tries; 1 for an unknown one (8a.nu exports 0)."""
    found = re.fullmatch(r"(\d{1,9})(\.0+)?", text.strip())
    return min(max(int(found[1]), 1), MAX_TRIES) if found else 1


def _printable_note(text: str) -> str:
    lines = (blank_unprintable(line).strip() for line in text.splitlines())
    return "\n".join(lines).strip()


def _shorten_text(text: str, most: int) -> str:
    return text if len(text) <= most else text[: most - 1] + "…"


def _error(key: str, hint: str, text: str) -> RequestError:
    return RequestError(key, hint, text=printable(text)[:MAX_SHOWN] or "–")

"""Logs in JSON: the export of Aurora's boards, and answers of MoonBoard's and TopLogger's pages.

The fields were taken from public programs that read them. Aurora sends its export by mail at a
person's request; MoonBoard and TopLogger export nothing, so the answers of their own pages are
read, which people save with such a program or with the browser's developer tools.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Final

from walltopo_gym.climbing_log.importing.lines import RawLine, text_of
from walltopo_gym.climbing_log.importing.tables import board_location
from walltopo_gym.climbing_log.other import OtherKind


def read_document(document: Any) -> tuple[str, list[RawLine]] | None:
    """Return the source of a parsed JSON document and its climbs; None for another document."""
    if isinstance(document, Mapping) and isinstance(document.get("ascents"), list):
        return "board", list(_read_aurora(document))
    entries = _entries_of(document)
    if entries and all(isinstance(entry.get("Problem"), Mapping) for entry in entries):
        return "MoonBoard", [_parse_moon(number, e) for number, e in enumerate(entries, 1)]
    if entries and all("tickType" in entry for entry in entries):
        return "TopLogger", [_parse_toplogger(number, e) for number, e in enumerate(entries, 1)]
    return None


def _entries_of(document: Any) -> list[Mapping[str, Any]]:
    """Return the list of objects in a document: the document itself, or below `data`."""
    for _ in range(4):
        if isinstance(document, list):
            return document if all(isinstance(entry, Mapping) for entry in document) else []
        if not isinstance(document, Mapping):
            return []
        names = ("Data", "data", "climbUsers")
        document = next((document[name] for name in names if name in document), None)
    return []


def _read_aurora(document: Mapping[str, Any]) -> Iterator[RawLine]:
    climbs = document.get("climbs")
    layouts = [text_of(climb, "layout") for climb in climbs or [] if isinstance(climb, Mapping)]
    board = next((layout for layout in layouts if layout), "Board")
    number = 0
    for part in ("ascents", "attempts"):
        entries = document.get(part)
        for entry in entries if isinstance(entries, list) else []:
            number += 1
            if isinstance(entry, Mapping):
                yield _parse_aurora(number, entry, board, is_top=part == "ascents")


def _parse_aurora(number: int, entry: Mapping[str, Any], board: str, *, is_top: bool) -> RawLine:
    tries = text_of(entry, "count", "bid_count")
    kind: OtherKind = ("flash" if tries == "1" else "top") if is_top else "try"
    return RawLine(
        number,
        "board",
        text_of(entry, "climb"),
        board_location(board, text_of(entry, "angle")),
        text_of(entry, "grade"),
        kind,
        "",
        tries,
        text_of(entry, "climbed_at", "created_at"),
        "boulder",
        text_of(entry, "comment"),
    )


_MOON_KINDS: Final[Mapping[str, tuple[OtherKind, str]]] = {
    "flashed": ("flash", "1"),
    "2nd try": ("top", "2"),
    "3rd try": ("top", "3"),
    "more than 3 tries": ("top", "4"),
    "project": ("project", ""),
}


def _parse_moon(number: int, entry: Mapping[str, Any]) -> RawLine:
    climb = entry["Problem"]
    style = text_of(entry, "NumberOfTries")
    kind, tries = _MOON_KINDS.get(style.lower(), (None, ""))
    return RawLine(
        number,
        "board",
        text_of(climb, "Name"),
        "MoonBoard",
        text_of(entry, "Grade") or text_of(climb, "UserGrade", "Grade"),
        kind,
        style,
        tries,
        text_of(entry, "DateClimbedAsString"),
        "boulder",
        text_of(entry, "Comment"),
    )


_TICKS: Final[Mapping[str, OtherKind]] = {"0": "try", "1": "top", "2": "flash"}
# TopLogger writes grades as numbers, the letters as thirds and a plus as a sixth: 6.33 is 6B.
_LETTERS: Final = {0: "A", 17: "A+", 33: "B", 50: "B+", 67: "C", 83: "C+"}


def _parse_toplogger(number: int, entry: Mapping[str, Any]) -> RawLine:
    climb = _object_at(entry, "climb")
    gym = _object_at(climb, "gym")
    colour = _object_at(entry, "holdColor") or _object_at(climb, "holdColor")
    is_boulder = text_of(climb, "climbType") != "route"
    style = text_of(entry, "tickType")
    return RawLine(
        number,
        "gym",
        text_of(climb, "name") or text_of(colour, "nameLoc"),
        text_of(gym, "name"),
        toplogger_grade(text_of(climb, "grade"), is_boulder=is_boulder),
        _TICKS.get(style),
        style,
        text_of(entry, "totalTries"),
        text_of(entry, "tickedFirstAtDate", "triedFirstAtDate"),
        "boulder" if is_boulder else "lead",
        key=f"climb {text_of(entry, 'id')}" if text_of(entry, "id") else "",
    )


def _object_at(entry: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    value = entry.get(name)
    return value if isinstance(value, Mapping) else {}


def toplogger_grade(text: str, *, is_boulder: bool) -> str:
    """Return the Font or French grade of TopLogger's number ("6.33", "633"); others stay text."""
    try:
        hundredths = round(float(text) * (1 if float(text) >= 100 else 100))
    except (ValueError, OverflowError):
        return text
    letter = _LETTERS.get(hundredths % 100)
    if letter is None or not 200 <= hundredths < 1000:
        return text
    grade = f"{hundredths // 100}{letter}"
    return grade if is_boulder else grade.lower()

"""Logs in CSV: of 8a.nu, theCrag, BoardLib (Kilter, Tension, MoonBoard), and of this platform.

The columns were taken from public importers of real exports (8a.nu 2024 to 2026, theCrag's
`logbook-csv`, BoardLib 0.2 to 0.13), as the services document none.
"""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

from walltopo_gym.climbing_log.importing.lines import RawLine, text_of
from walltopo_gym.climbing_log.other import Discipline, OtherKind, Venue
from walltopo_gym.spreadsheets import column_names, plain_lines, unescape_formula

Cells = Mapping[str, str]


@dataclass(frozen=True)
class TableKind:
    """A layout of a table: its columns tell it apart from the others.

    Parameters
    ----------
    needed : names of columns, as `column_names` writes them.
    """

    source: str
    needed: frozenset[str]
    parse: Callable[[int, Cells], RawLine]


def read_rows(text: str) -> tuple[list[str], Iterator[tuple[int, Cells]]]:
    """Return the names of a table's columns, and its lines that are not empty by number.

    Parameters
    ----------
    text : lines with commas, semicolons or tabs between the columns; the first names them.

    Raises
    ------
    csv.Error : a quote is never closed, or a cell is longer than 131,072 characters.
    """
    text = plain_lines(text)
    head = text.partition("\n")[0]
    separator = max(",;\t", key=head.count)
    reader = csv.reader(io.StringIO(text), delimiter=separator, strict=True)
    names = column_names(next(reader, []))

    def rows() -> Iterator[tuple[int, Cells]]:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                plain = (unescape_formula(cell.strip()) for cell in cells)
                yield reader.line_num, dict(zip(names, plain, strict=False))

    return names, rows()


_8A_KINDS: Final[Mapping[str, OtherKind]] = {
    "os": "onsight",
    "f": "flash",
    "rp": "top",
    "tr": "top",
    "go": "try",
}


def _parse_8a(number: int, cells: Cells) -> RawLine:
    style = text_of(cells, "type").lower()
    sector = text_of(cells, "sector_name")
    crag = text_of(cells, "location_name") or text_of(cells, "area_name")
    known = sector and sector != "Unknown Sector" and sector != crag
    is_boulder = text_of(cells, "route_boulder").upper() == "BOULDER"
    rope: Discipline = "top-rope" if style == "tr" else "lead"
    return RawLine(
        number,
        "outdoors",
        text_of(cells, "name"),
        f"{crag}, {sector}" if known and crag else crag or sector,
        text_of(cells, "difficulty"),
        _8A_KINDS.get(style),
        style,
        text_of(cells, "tries"),
        text_of(cells, "date")[:10],
        "boulder" if is_boulder else rope,
        text_of(cells, "comment"),
    )


_CRAG_TOPS: Final = frozenset(
    {
        "red point",
        "redpoint",
        "pink point",
        "greenpoint",
        "ground up red point",
        "clean",
        "send",
        "tick",
        "lead solo",
        "roped solo",
        "second clean",
        "top rope",
        "top rope clean",
        "aid",
        "aid solo",
    }
)
_CRAG_TRIES: Final = frozenset(
    {"attempt", "working", "hang dog", "retreat", "dab", "second with rest", "top rope with rest"}
)
_CRAG_KINDS: Final[Mapping[str, OtherKind]] = {
    "onsight": "onsight",
    "onsight solo": "onsight",
    "greenpoint onsight": "onsight",
    "second onsight": "onsight",
    "top rope onsight": "onsight",
    "flash": "flash",
    "top rope flash": "flash",
    "second flash": "flash",
    "repeat": "repeat",
    "target": "project",
    **dict.fromkeys(_CRAG_TOPS, "top"),
    **dict.fromkeys(_CRAG_TRIES, "try"),
}


def _parse_crag(number: int, cells: Cells) -> RawLine:
    style = text_of(cells, "ascent_type")
    kind = style.lower().removeprefix("sport ").removeprefix("trad ")
    gear = text_of(cells, "ascent_gear_style", "route_gear_style").lower()
    is_top_rope = gear == "top rope" or kind.startswith("top rope")
    rope: Discipline = "top-rope" if is_top_rope else "lead" if gear else ""
    ascent = text_of(cells, "ascent_id").removesuffix(".0")
    return RawLine(
        number,
        "outdoors",
        text_of(cells, "route_name", "ascent_label"),
        text_of(cells, "crag_name", "crag_path"),
        text_of(cells, "ascent_grade", "route_grade"),
        _CRAG_KINDS.get(kind),
        style,
        "",
        text_of(cells, "ascent_date"),
        "boulder" if gear == "boulder" else rope,
        text_of(cells, "comment"),
        f"ascent {ascent}" if ascent else "",
    )


def _parse_boardlib(number: int, cells: Cells) -> RawLine:
    tries = text_of(cells, "tries")
    is_true = "true"
    kind: OtherKind
    if text_of(cells, "is_ascent").lower() not in (is_true, ""):
        kind = "try"
    elif text_of(cells, "is_repeat").lower() == is_true:
        kind = "repeat"
    else:
        kind = "flash" if tries == "1" and text_of(cells, "tries_total") in ("", "1") else "top"
    board, angle = text_of(cells, "board"), text_of(cells, "angle")
    return RawLine(
        number,
        "board",
        text_of(cells, "climb_name", "name"),
        board_location(board, angle),
        text_of(cells, "logged_grade", "displayed_grade", "grade"),
        kind,
        "",
        tries,
        text_of(cells, "date"),
        "boulder",
        text_of(cells, "comment"),
    )


def board_location(board: str, angle: str) -> str:
    """Return a board's name with its angle: "Kilter 40°"."""
    name = board[:1].upper() + board[1:]
    return f"{name} {angle.removesuffix('.0')}°".strip() if angle else name


_OWN_KINDS: Final[Mapping[str, OtherKind]] = {
    "onsight": "onsight",
    "flash": "flash",
    "top": "top",
    "repeat": "repeat",
    "hang": "try",
    "high-point": "try",
    "zone": "try",
    "try": "try",
    "project": "project",
}
_VENUES: Final[Mapping[str, Venue]] = {"outdoors": "outdoors", "gym": "gym", "board": "board"}
_DISCIPLINES: Final[Mapping[str, Discipline]] = {
    "boulder": "boulder",
    "lead": "lead",
    "top-rope": "top-rope",
    "auto-belay": "auto-belay",
}


def _parse_own(number: int, cells: Cells) -> RawLine:
    kind = text_of(cells, "kind")
    return RawLine(
        number,
        _VENUES.get(text_of(cells, "venue"), "gym"),
        text_of(cells, "name", "route_name"),
        text_of(cells, "location", "gym_name"),
        text_of(cells, "grade"),
        _OWN_KINDS.get(kind),
        kind,
        text_of(cells, "tries"),
        text_of(cells, "climbed_at", "day"),
        _DISCIPLINES.get(text_of(cells, "discipline"), ""),
        text_of(cells, "note"),
    )


KINDS: Final = (
    TableKind("8a.nu", frozenset({"route_boulder", "name", "date", "difficulty"}), _parse_8a),
    TableKind("theCrag", frozenset({"ascent_type", "route_name", "ascent_date"}), _parse_crag),
    TableKind("board", frozenset({"board", "climb_name", "date", "tries"}), _parse_boardlib),
    TableKind("board", frozenset({"board", "angle", "name", "date", "grade"}), _parse_boardlib),
    TableKind("walltopo", frozenset({"climbed_at", "gym_name", "kind"}), _parse_own),
    TableKind("walltopo", frozenset({"climbed_at", "location", "kind"}), _parse_own),
)

"""Import of routes from a table."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import date
from typing import Any, Final
from uuid import UUID, uuid5

from sqlalchemy.orm import Session

from walltopo_gym.errors import RequestError
from walltopo_gym.publishing.by_hand import (
    MAX_ROUTES,
    FactError,
    Grades,
    HandRoute,
    check_facts,
)
from walltopo_gym.publishing.colours import colour_of
from walltopo_gym.publishing.lines import lines_of
from walltopo_gym.publishing.versions import wall_routes
from walltopo_gym.spreadsheets import MAX_FAULTS, MAX_SHOWN, Fault, check_cell, read_table
from walltopo_gym.walls.models import Wall

COLUMNS: Final = (
    "name",
    "grade",
    "grade_system",
    "colour",
    "setter",
    "tags",
    "set_on",
    "strip_on",
    "line",
)
_DAYS: Final = ("set_on", "strip_on")
_MAX_TEXT: Final = {"name": 80, "colour": 40, "setter": 80}
_MAX_TAGS: Final = 20
_MAX_TAG: Final = 80
# 2026-11-24, 24. 11. 2026, and with slashes both 24/11/2026 and 11/24/2026.
_ISO: Final = re.compile(r"(\d{4})-(\d{1,2})-(\d{1,2})", re.ASCII)
_DOTS: Final = re.compile(r"(\d{1,2})\. ?(\d{1,2})\. ?(\d{4})", re.ASCII)
_SLASHES: Final = re.compile(r"(\d{1,2})/(\d{1,2})/(\d{4})", re.ASCII)
_MONTHS: Final = 12
_YEARS: Final = range(1900, 2200)


@dataclass(frozen=True)
class TableLine:
    """A route of a table; `known`: the wall has a route with the same name, colour and grade."""

    line: int
    route: HandRoute
    known: bool


def read_routes(
    session: Session, wall: Wall, text: str, table: UUID, today: date
) -> tuple[list[TableLine], list[Fault]]:
    """Return the right lines of a table, and the errors of the others.

    Parameters
    ----------
    text : the table, as `read_table` reads it.
    table : its id; the ids of its routes follow from it and their lines.
    today : the set date of lines without one.

    Raises
    ------
    RequestError : the text is not such a table.
    """
    grades = Grades(session, wall.gym_id)
    ropes = {line.label: line.id for line in lines_of(session, wall.id)}
    table_lines = list(read_table(text, COLUMNS, "name", MAX_ROUTES))
    order = _date_order([cells.get(name, "") for _, cells in table_lines for name in _DAYS])
    there = {(row.name, row.colour, row.grade) for row, _ in wall_routes(session, wall)}
    lines: list[TableLine] = []
    faults: list[Fault] = []
    for number, cells in table_lines:
        facts, wrong = _parse_facts(cells, grades, ropes, today, order)
        if wrong:
            faults.extend(Fault(number, *one) for one in wrong)
        else:
            route = HandRoute(uuid5(table, str(number)), facts)
            key = facts["name"], facts["colour"], facts["grade"]
            lines.append(TableLine(number, route, key in there))
        if len(faults) >= MAX_FAULTS:
            break
    return lines, faults


def _parse_facts(
    cells: dict[str, str], grades: Grades, ropes: Mapping[str, UUID], today: date, order: str
) -> tuple[dict[str, Any], list[FactError]]:
    """Return the columns of a route, and what is wrong with its cells."""
    wrong: list[FactError] = []
    words = {
        name: _parse_text(cells.get(name, ""), name, most, wrong)
        for name, most in _MAX_TEXT.items()
    }
    facts: dict[str, Any] = words | {
        "colour": colour_of(words["colour"]),
        "tags": _parse_tags(cells.get("tags", ""), wrong),
        "set_on": _parse_day(cells.get("set_on", ""), "set_on", order, wrong) or today,
        "strip_on": _parse_day(cells.get("strip_on", ""), "strip_on", order, wrong),
        "grade_system_id": None,
        "grade": "",
        "line_id": _parse_line(cells.get("line", ""), ropes, wrong),
    }
    if cells.get("grade"):
        try:
            system = cells.get("grade_system", "")
            facts["grade_system_id"], facts["grade"] = grades.find(cells["grade"], system)
        except RequestError as fault:
            is_system = fault.key == "cell-no-system"
            wrong.append(FactError("grade_system" if is_system else "grade", fault))
    if not wrong:
        wrong = check_facts(facts)
    return facts, wrong


def _parse_text(cell: str, name: str, most: int, wrong: list[FactError]) -> str:
    fault = check_cell(cell, most)
    if fault is not None:
        wrong.append(FactError(name, fault))
    return cell


def _parse_tags(cell: str, wrong: list[FactError]) -> list[str]:
    """Return the tags of a cell, which commas, semicolons or vertical bars separate."""
    tags = [tag.strip() for tag in re.split(r"[,;|]", cell) if tag.strip()]
    fault = next((found for tag in tags if (found := check_cell(tag, _MAX_TAG))), None)
    if len(tags) > _MAX_TAGS:
        fault = RequestError("cell-many-tags", most=_MAX_TAGS)
    if fault is not None:
        wrong.append(FactError("tags", fault))
    return tags


def _parse_line(cell: str, ropes: Mapping[str, UUID], wrong: list[FactError]) -> UUID | None:
    """Return the id of the line with a label; None for an empty cell."""
    if not cell or cell in ropes:
        return ropes.get(cell)
    known = ", ".join(ropes) or "–"
    fault = RequestError("cell-no-line", "cell-lines", label=cell[:MAX_SHOWN], labels=known)
    wrong.append(FactError("line", fault))
    return None


def _date_order(days: Sequence[str]) -> str:
    """Return "dmy" or "mdy" for a table's dates with slashes; empty if none of them decides it.

    Parameters
    ----------
    days : the cells of the columns of days.
    """
    found = [match.groups() for day in days if (match := _SLASHES.fullmatch(day))]
    orders = {
        "dmy": any(int(first) > _MONTHS for first, _, _ in found),
        "mdy": any(int(second) > _MONTHS for _, second, _ in found),
    }
    sure = [order for order, is_sure in orders.items() if is_sure]
    return sure[0] if len(sure) == 1 else ""


def _parse_day(cell: str, name: str, order: str, wrong: list[FactError]) -> date | None:
    if not cell:
        return None
    forms = (("ymd", _ISO), ("dmy", _DOTS), (order, _SLASHES))
    for parts, form in forms:
        found = form.fullmatch(cell)
        if found is not None and parts:
            values = dict(zip(parts, map(int, found.groups()), strict=True))
            with suppress(ValueError):
                if values["y"] in _YEARS:
                    return date(values["y"], values["m"], values["d"])
    fault = RequestError("cell-no-day", "cell-write-day", cell=cell[:MAX_SHOWN])
    wrong.append(FactError(name, fault))
    return None

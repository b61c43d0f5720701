"""A start list from a table: all of its lines, or none."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.competitions.entering import EntryWords, misfit, next_bib
from walltopo_gym.competitions.models import Category, Competition, Entry

__all__ = ["COLUMNS", "Fault", "read_start_list", "take_in"]

COLUMNS: Final = ("name", "category", "bib", "team", "club", "birth_year", "gender", "handicap")
MOST_LINES: Final = 2_000
_MOST_FAULTS: Final = 100
_WORDS: Final = 80
_LINE: Final = re.compile(r"[^\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]*")
_GENDERS: Final = {"": "", "w": "women", "f": "women", "women": "women", "m": "men", "men": "men",
                   "other": "other", "x": "other"}  # fmt: skip
_NUMBERS: Final = {"bib": (1, 99_999), "birth_year": (1900, 2100), "handicap": (-100_000, 100_000)}


@dataclass(frozen=True)
class Fault:
    """What is wrong in a line (the head is line 1)."""

    line: int
    column: str
    why: str


def read_start_list(
    session: Session, row: Competition, text: str
) -> tuple[list[EntryWords], list[Fault]]:
    """The entries of a table and what is wrong with it.

    Parameters
    ----------
    text : lines with commas, semicolons or tabs between the columns; the first names them.

    Raises
    ------
    InputError : it is no such table.
    """
    reader, columns = _open(text)
    categories = {
        category.name.casefold(): category
        for category in session.scalars(select(Category).where(Category.competition_id == row.id))
    }
    taken = set(session.scalars(select(Entry.bib).where(Entry.competition_id == row.id)))
    entries: list[EntryWords] = []
    faults: list[Fault] = []
    for number, line in _lines(reader):
        if not any(cell.strip() for cell in line):
            continue
        if len(entries) >= MOST_LINES:
            raise InputError(f"more than {MOST_LINES} lines", "Import it in parts.")
        cells = {name: cell.strip() for name, cell in zip(columns, line, strict=False)}
        found, wrong = _entry(cells, categories, taken)
        faults.extend(Fault(number, column, why) for column, why in wrong)
        entries.append(found)
        if len(faults) >= _MOST_FAULTS:
            break
    return entries, faults


def take_in(session: Session, row: Competition, entries: list[EntryWords]) -> None:
    """Add entries that were read without a fault."""
    taken = set(session.scalars(select(Entry.bib).where(Entry.competition_id == row.id)))
    taken |= {words.bib for words in entries if words.bib}
    for words in entries:
        bib = words.bib or next_bib(taken)
        taken.add(bib)
        session.add(Entry(competition_id=row.id, withdrawn=False, **{**vars(words), "bib": bib}))
    row.revision += 1
    session.flush()


def _open(text: str) -> tuple[Any, list[str]]:
    """A reader after its head, and the head's columns."""
    head = text.lstrip("\ufeff").partition("\n")[0]
    between = max(",;\t", key=head.count)
    reader = csv.reader(io.StringIO(text.lstrip("\ufeff")), delimiter=between, strict=True)
    try:
        columns = [cell.strip().lower().replace(" ", "_") for cell in next(reader)]
    except (StopIteration, csv.Error) as error:
        raise InputError("this is no table", "Its first line names the columns.") from error
    unknown = [name for name in columns if name not in COLUMNS]
    if unknown:
        raise InputError(f"no column {unknown[0][:40]!r} is known",
                         f"Known are {', '.join(COLUMNS)}.")  # fmt: skip
    if len(set(columns)) < len(columns):
        raise InputError("a column is there twice")
    if "name" not in columns:
        raise InputError("there is no column name", "Its first line names the columns.")
    return reader, columns


def _lines(reader: Any) -> Iterator[tuple[int, list[str]]]:
    """Lines of a table by their numbers; what is no table is told as such."""
    try:
        for line in reader:
            yield reader.line_num, line
    except csv.Error as error:
        raise InputError(f"line {reader.line_num} is not of a table") from error


def _entry(
    cells: dict[str, str], categories: dict[str, Category], taken: set[int]
) -> tuple[EntryWords, list[tuple[str, str]]]:
    wrong: list[tuple[str, str]] = []
    for name in ("name", "team", "club"):
        cell = cells.get(name, "")
        if len(cell) > _WORDS or not _LINE.fullmatch(cell):
            wrong.append((name, f"more than {_WORDS} characters, or one that cannot be printed"))
    if not cells.get("name"):
        wrong.append(("name", "empty"))
    numbers = {name: _number(cells.get(name, ""), name, wrong) for name in _NUMBERS}
    gender = _GENDERS.get(cells.get("gender", "").lower())
    if gender is None:
        wrong.append(("gender", "neither w, m, x nor empty"))
    bib = numbers["bib"]
    if bib is not None and bib in taken:
        wrong.append(("bib", f"bib {bib} is taken"))
    elif bib is not None:
        taken.add(bib)
    category = _category(cells.get("category", ""), categories)
    if category is None:
        wrong.append(("category", f"no category {cells.get('category', '')[:40]!r}"))
        category = next(iter(categories.values()))
    elif why := misfit(category, gender or "", numbers["birth_year"]):
        wrong.append(("category", why))
    words = EntryWords(
        cells.get("name", ""), category.id, bib, cells.get("team", ""), cells.get("club", ""),
        numbers["birth_year"], gender or "", numbers["handicap"] or 0,
    )  # fmt: skip
    return words, wrong


def _category(name: str, categories: dict[str, Category]) -> Category | None:
    """By its name; without one the only one there is."""
    if not name and len(categories) == 1:
        return next(iter(categories.values()))
    return categories.get(name.casefold())


def _number(cell: str, name: str, wrong: list[tuple[str, str]]) -> int | None:
    if not cell:
        return None
    low, high = _NUMBERS[name]
    is_number = re.fullmatch(r"-?[0-9]{1,6}", cell) is not None
    if not is_number or not low <= int(cell) <= high:
        wrong.append((name, f"not a number from {low} to {high}"))
        return None
    return int(cell)

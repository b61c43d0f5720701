"""A start list from a table: all of its lines, or none."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final, NamedTuple

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.competitions.entering import EntryWords, misfit, next_bib
from walltopo_gym.competitions.models import Category, Competition, Entry

COLUMNS: Final = ("name", "category", "bib", "team", "club", "birth_year", "gender", "handicap")
MOST_LINES: Final = 2_000
_MOST_FAULTS: Final = 100
_WORDS: Final = 80
_SHOWN: Final = 40  # characters of a cell in what is said of it
_LINE: Final = re.compile(r"[^\x00-\x1f\x7f-\x9f\u2028-\u202e\u2066-\u2069]*")
_GENDERS: Final = {"": "", "w": "women", "f": "women", "women": "women", "m": "men", "men": "men",
                   "other": "other", "x": "other"}  # fmt: skip
_NUMBERS: Final = {"bib": (1, 99_999), "birth_year": (1900, 2100), "handicap": (-100_000, 100_000)}


@dataclass(frozen=True)
class Fault:
    """What is wrong in a line (the head is line 1), and what to do."""

    line: int
    column: str
    why: str
    hint: str


class _Wrong(NamedTuple):
    """The same within its line."""

    column: str
    why: str
    hint: str


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
    there = select(Category).where(Category.competition_id == row.id).order_by(Category.place)
    categories = {category.name.casefold(): category for category in session.scalars(there)}
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
        faults.extend(Fault(number, *one) for one in wrong)
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
) -> tuple[EntryWords, list[_Wrong]]:
    wrong: list[_Wrong] = []
    _check_words(cells, wrong)
    numbers = {name: _number(cells.get(name, ""), name, wrong) for name in _NUMBERS}
    cell = cells.get("gender", "")
    gender = _GENDERS.get(cell.lower())
    if gender is None:
        wrong.append(_Wrong("gender", f"the gender {cell[:_SHOWN]!r} is not known",
                            "Write w, m or x, or leave it empty."))  # fmt: skip
    bib = numbers["bib"]
    if bib is not None and bib in taken:
        hint = "Choose another one; an empty cell gets the next free one."
        wrong.append(_Wrong("bib", f"bib {bib} is taken", hint))
    elif bib is not None:
        taken.add(bib)
    category = _category(cells.get("category", ""), categories, wrong)
    if category is not None:
        _check_fits(category, gender, numbers["birth_year"], wrong)
    anywhere = category or next(iter(categories.values()))  # with a fault nothing is taken in
    words = EntryWords(
        cells.get("name", ""), anywhere.id, bib, cells.get("team", ""), cells.get("club", ""),
        numbers["birth_year"], gender or "", numbers["handicap"] or 0,
    )  # fmt: skip
    return words, wrong


def _check_words(cells: dict[str, str], wrong: list[_Wrong]) -> None:
    for name in ("name", "team", "club"):
        cell = cells.get(name, "")
        if len(cell) > _WORDS or not _LINE.fullmatch(cell):
            wrong.append(
                _Wrong(name, f"more than {_WORDS} characters, or one that cannot be printed",
                       "Shorten it, or type it anew.")
            )  # fmt: skip
    if not cells.get("name"):
        wrong.append(_Wrong("name", "the name is missing", "Write one, or take the line out."))


def _category(name: str, categories: dict[str, Category], wrong: list[_Wrong]) -> Category | None:
    """By its name; without one the only one there is. None where there is no such, which is
    noted."""
    if not name and len(categories) == 1:
        return next(iter(categories.values()))
    found = categories.get(name.casefold())
    if found is None:
        names = ", ".join(category.name for category in categories.values())
        why = f"there is no category {name[:_SHOWN]!r}" if name else "the category is missing"
        wrong.append(_Wrong("category", why, f"The categories are {names}."))
    return found


def _check_fits(
    category: Category, gender: str | None, birth_year: int | None, wrong: list[_Wrong]
) -> None:
    """Note why somebody is not of a category; of what could not be read that was said already."""
    said = category.gender if gender is None else gender
    why = misfit(category, said, birth_year)
    by_year = not category.gender or said == category.gender
    if not why or (by_year and any(one.column == "birth_year" for one in wrong)):
        return
    hint = "Choose another category."
    if by_year and birth_year is None:
        hint = "Write it into the column birth_year."
    elif not by_year and not said:
        hint = "Write it into the column gender."
    wrong.append(_Wrong("category", why, hint))


def _number(cell: str, name: str, wrong: list[_Wrong]) -> int | None:
    if not cell:
        return None
    low, high = _NUMBERS[name]
    is_number = re.fullmatch(r"-?[0-9]{1,6}", cell) is not None
    if not is_number or not low <= int(cell) <= high:
        wrong.append(_Wrong(name, f"{cell[:_SHOWN]!r} is not a number from {low} to {high}",
                            "Write digits alone, or leave it empty."))  # fmt: skip
        return None
    return int(cell)

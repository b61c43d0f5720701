"""Import of start lists: all lines, or none."""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final, NamedTuple
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.competitions.bodies import EntryBody
from walltopo_gym.competitions.entering import misfit, next_bib
from walltopo_gym.competitions.models import Category, Competition, Entry
from walltopo_gym.errors import RequestError
from walltopo_gym.spreadsheets import MAX_FAULTS, MAX_SHOWN, Fault, check_cell, read_table
from walltopo_gym.texts import same_key

COLUMNS: Final = ("name", "category", "bib", "team", "club", "birth_year", "gender", "handicap")
MAX_LINES: Final = 2_000
_WORDS: Final = 80
_GENDERS: Final = {
    "": "",
    "w": "women",
    "f": "women",
    "women": "women",
    "m": "men",
    "men": "men",
    "other": "other",
    "x": "other",
}
_NUMBERS: Final = {"bib": (1, 99_999), "birth_year": (1900, 2100), "handicap": (-100_000, 100_000)}


class _CellError(NamedTuple):
    """An error in a cell of a line."""

    column: str
    error: RequestError


class KnownLine(NamedTuple):
    """A line whose competitor seems to be entered already; `entry`: that entry."""

    line: int
    entry: Entry


class StartList(NamedTuple):
    """The content of a table: new entries, lines of competitors who are entered already, errors."""

    entries: list[EntryBody]
    known: list[KnownLine]
    faults: list[Fault]


def read_start_list(
    session: Session, row: Competition, text: str, others: Collection[int] = ()
) -> StartList:
    """Return the entries of a table that are new, and its errors.

    Parameters
    ----------
    text : a table as `read_table` reads it.
    others : lines of people who are not those of the same name on the list.

    Raises
    ------
    RequestError : the text is not such a table.
    """
    there = select(Category).where(Category.competition_id == row.id).order_by(Category.place)
    categories = {same_key(category.name): category for category in session.scalars(there)}
    there_already = _Entered(session, row)
    taken = set(there_already.bibs)
    entries: list[EntryBody] = []
    faults: list[Fault] = []
    known: list[KnownLine] = []
    for number, cells in read_table(text, COLUMNS, "name", MAX_LINES):
        found, wrong = _parse_entry(cells, categories)
        same = None if wrong or number in others else there_already.take(found)
        if same is not None:
            known.append(KnownLine(number, same))
            continue
        wrong += _check_bib(found.bib, taken)
        faults.extend(Fault(number, *one) for one in wrong)
        entries.append(found)
        if len(faults) >= MAX_FAULTS:
            break
    return StartList(entries, known, faults)


class _Entered:
    """The competitors of a competition, to recognise a line that was imported before."""

    def __init__(self, session: Session, row: Competition) -> None:
        every = session.scalars(select(Entry).where(Entry.competition_id == row.id)).all()
        self.bibs = {entry.bib for entry in every}
        self._by_name: dict[tuple[str, UUID], list[Entry]] = {}
        for entry in every:
            key = same_key(entry.name), entry.category_id
            self._by_name.setdefault(key, []).append(entry)

    def take(self, words: EntryBody) -> Entry | None:
        """Return the competitor whom a line means, and none of its cells contradicts; None if it is
        somebody else.

        Each competitor is taken once: two lines of one name are two people.
        """
        among = self._by_name.get((same_key(words.name), words.category_id), [])
        meant = [entry for entry in among if not _contradicts_entry(words, entry)]
        if not meant:
            return None
        found = max(meant, key=lambda entry: _count_equal_fields(words, entry))
        among.remove(found)
        return found


# Facts that tell two people of one name apart where both have them.
_TELLING: Final = ("bib", "birth_year", "club", "team", "gender")


def _contradicts_entry(words: EntryBody, entry: Entry) -> bool:
    return any(
        one and other and _comparison_key(one) != _comparison_key(other)
        for one, other in ((getattr(words, name), getattr(entry, name)) for name in _TELLING)
    )


def _count_equal_fields(words: EntryBody, entry: Entry) -> int:
    pairs = ((getattr(words, name), getattr(entry, name)) for name in _TELLING)
    return sum(_comparison_key(one) == _comparison_key(other) for one, other in pairs)


def _comparison_key(value: str | int | None) -> str | int | None:
    return same_key(value) if isinstance(value, str) else value


def take_in(session: Session, row: Competition, entries: list[EntryBody]) -> None:
    """Add entries that were read without errors."""
    taken = set(session.scalars(select(Entry.bib).where(Entry.competition_id == row.id)))
    taken |= {words.bib for words in entries if words.bib}
    for words in entries:
        bib = words.bib or next_bib(taken)
        taken.add(bib)
        session.add(
            Entry(competition_id=row.id, withdrawn=False, **{**words.model_dump(), "bib": bib})
        )
    row.revision += 1
    session.flush()


def _check_bib(bib: int | None, taken: set[int]) -> list[_CellError]:
    """Take a number; return an error if somebody else has it."""
    if bib is None:
        return []
    if bib in taken:
        return [_CellError("bib", RequestError("cup-bib-taken", "cell-other-bib", bib=bib))]
    taken.add(bib)
    return []


def _parse_entry(
    cells: dict[str, str], categories: dict[str, Category]
) -> tuple[EntryBody, list[_CellError]]:
    wrong: list[_CellError] = []
    _check_words(cells, wrong)
    numbers = {name: _parse_number(cells.get(name, ""), name, wrong) for name in _NUMBERS}
    cell = cells.get("gender", "")
    gender = _GENDERS.get(cell.lower())
    if gender is None:
        wrong.append(
            _CellError(
                "gender", RequestError("cell-gender", "cell-gender-write", name=cell[:MAX_SHOWN])
            )
        )
    category = _find_category(cells.get("category", ""), categories, wrong)
    if category is not None:
        _check_fits(category, gender, numbers["birth_year"], wrong)
    anywhere = category or next(iter(categories.values()))  # with a fault nothing is taken in
    # Each cell was checked above, with words for its line and column.
    words = EntryBody.model_construct(
        name=cells.get("name", ""),
        category_id=anywhere.id,
        bib=numbers["bib"],
        team=cells.get("team", ""),
        club=cells.get("club", ""),
        birth_year=numbers["birth_year"],
        gender=gender or "",
        handicap=numbers["handicap"] or 0,
    )
    return words, wrong


def _check_words(cells: dict[str, str], wrong: list[_CellError]) -> None:
    for name in ("name", "team", "club"):
        error = check_cell(cells.get(name, ""), _WORDS)
        if error is not None:
            wrong.append(_CellError(name, error))
    if not cells.get("name"):
        wrong.append(_CellError("name", RequestError("cell-no-name", "cell-write-name")))


def _find_category(
    name: str, categories: dict[str, Category], wrong: list[_CellError]
) -> Category | None:
    """Return the category by name; without a name, the only one. Note an error if there is none."""
    if not name and len(categories) == 1:
        return next(iter(categories.values()))
    found = categories.get(same_key(name))
    if found is None:
        names = ", ".join(category.name for category in categories.values())
        key = "cell-no-category" if name else "cell-category-missing"
        error = RequestError(key, "cell-categories", name=name[:MAX_SHOWN], names=names)
        wrong.append(_CellError("category", error))
    return found


def _check_fits(
    category: Category, gender: str | None, birth_year: int | None, wrong: list[_CellError]
) -> None:
    """Note why a competitor does not fit the category, unless an error of the cell is noted
    already."""
    entered = category.gender if gender is None else gender
    by_year = not category.gender or entered == category.gender
    hint = "cup-choose-category"
    if by_year and birth_year is None:
        hint = "cell-year-column"
    elif not by_year and not entered:
        hint = "cell-gender-column"
    error = misfit(category, entered, birth_year, hint)
    if error is None or (by_year and any(one.column == "birth_year" for one in wrong)):
        return
    wrong.append(_CellError("category", error))


def _parse_number(cell: str, name: str, wrong: list[_CellError]) -> int | None:
    if not cell:
        return None
    low, high = _NUMBERS[name]
    is_number = re.fullmatch(r"-?[0-9]{1,6}", cell) is not None
    if not is_number or not low <= int(cell) <= high:
        wrong.append(
            _CellError(
                name,
                RequestError(
                    "cell-number", "cell-digits", cell=cell[:MAX_SHOWN], low=low, high=high
                ),
            )
        )
        return None
    return int(cell)

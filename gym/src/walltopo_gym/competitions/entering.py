"""Who takes part: entries, bibs, and the text that is accepted."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any, Final
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.competitions.models import Category, Competition, Entry, WaiverSignature
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError

NO_NAME: Final = "—"


@dataclass(frozen=True)
class EntryWords:
    """What is said of a competitor."""

    name: str
    category_id: UUID
    bib: int | None = None
    team: str = ""
    club: str = ""
    birth_year: int | None = None
    gender: str = ""
    handicap: int = 0


def entry_of(session: Session, row: Competition, entry: UUID) -> Entry:
    """An entry of this competition.

    Raises
    ------
    NotFoundError : there is none, or it is another one's.
    """
    found = session.get(Entry, entry)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("no such entry")
    return found


def own_entry(session: Session, row: Competition, person: UUID) -> Entry | None:
    """Somebody's own; None where they have not entered."""
    mine = select(Entry).where(Entry.competition_id == row.id, Entry.person_id == person)
    return session.scalar(mine)


def add_entry(
    session: Session, row: Competition, words: EntryWords, person: UUID | None = None
) -> Entry:
    """Let somebody take part; without a bib the next free one.

    Raises
    ------
    NotFoundError : no such category; InputError : it is not theirs; ConflictError : bib taken.
    """
    category = category_of(session, row, words.category_id)
    _check_fits(category, words)
    taken = set(session.scalars(select(Entry.bib).where(Entry.competition_id == row.id)))
    bib = words.bib or next_bib(taken)
    if bib in taken:
        raise ConflictError(f"bib {bib} is taken")
    entry = Entry(
        competition_id=row.id, person_id=person, withdrawn=False, **{**vars(words), "bib": bib}
    )
    session.add(entry)
    row.revision += 1
    session.flush()
    return entry


def change_entry(session: Session, row: Competition, entry: Entry, given: dict[str, Any]) -> None:
    """Say something else of a competitor; what is not given stays.

    Raises
    ------
    As `add_entry`.
    """
    names = EntryWords.__dataclass_fields__
    words = EntryWords(**{name: given.get(name, getattr(entry, name)) for name in names})
    _check_fits(category_of(session, row, words.category_id), words)
    same = select(Entry.id).where(
        Entry.competition_id == row.id, Entry.bib == words.bib, Entry.id != entry.id
    )
    if session.scalar(same) is not None:
        raise ConflictError(f"bib {words.bib} is taken")
    for name, value in given.items():
        setattr(entry, name, value)
    row.revision += 1
    session.flush()


def enter(
    session: Session, row: Competition, words: EntryWords, person: UUID, waiver: str
) -> Entry:
    """Let somebody enter themselves, or say otherwise what they said; the text is accepted by it.

    Raises
    ------
    ForbiddenError : the gym enters people itself, or has withdrawn this one; ConflictError : it is
    too late, or the text was changed meanwhile.
    """
    if not row.self_entry:
        raise ForbiddenError("the gym enters people itself here", "Ask at the desk.")
    if row.state not in ("open", "running"):
        raise ConflictError("one cannot enter this competition now")
    if waiver != row.waiver:
        raise ConflictError("the text to accept was changed meanwhile", "Read it again.")
    entry = own_entry(session, row, person)
    if entry is not None and entry.withdrawn and entry.removed:
        raise ForbiddenError("the gym has withdrawn your entry", "Ask at the desk.")
    if entry is None:
        entry = add_entry(session, row, words, person)
    else:
        kept = {"bib": entry.bib, "handicap": entry.handicap}
        if words.category_id != entry.category_id and row.state == "running":
            raise ConflictError("the category stays while it runs", "Ask a judge.")
        change_entry(session, row, entry, {**vars(words), **kept, "withdrawn": False})
    sign(session, row, entry, words.name, person, on_paper=False)
    return entry


def sign(
    session: Session, row: Competition, entry: Entry, signed_by: str, person: UUID, *,
    on_paper: bool,
) -> None:  # fmt: skip
    """Keep that the text of today was accepted; nothing where there is none."""
    if row.waiver:
        session.add(
            WaiverSignature(entry_id=entry.id, person_id=person, on_paper=on_paper,
                            signed_by=signed_by, text=row.waiver)
        )  # fmt: skip
        session.flush()


def next_bib(taken: Collection[int]) -> int:
    """The number after the highest."""
    return max(taken, default=0) + 1


def category_of(session: Session, row: Competition, category: UUID) -> Category:
    """A category of this competition.

    Raises
    ------
    NotFoundError : there is none, or it is another one's.
    """
    found = session.get(Category, category)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("no such category")
    return found


def misfit(category: Category, gender: str, birth_year: int | None) -> str:
    """Why somebody is not of a category; empty where they are."""
    if category.gender and gender != category.gender:
        return f"the category {category.name!r} is for another gender"
    bounds = category.born_from, category.born_to
    if bounds == (None, None):
        return ""
    if birth_year is None:
        return f"the category {category.name!r} needs a year of birth"
    first, last = bounds[0] or birth_year, bounds[1] or birth_year
    if not first <= birth_year <= last:
        return f"{birth_year} is not a year of the category {category.name!r}"
    return ""


def forget_names(session: Session, person: UUID) -> None:
    """Take somebody out of start lists and signatures by name; ranks stay as they are."""
    session.execute(
        update(Entry).where(Entry.person_id == person)
        .values(name=NO_NAME, team="", club="", birth_year=None)
    )  # fmt: skip
    session.execute(
        update(WaiverSignature).where(WaiverSignature.person_id == person,
                                      WaiverSignature.on_paper.is_(False))
        .values(signed_by=NO_NAME)
    )  # fmt: skip


def entries_in(session: Session, competitions: Collection[UUID]) -> dict[UUID, int]:
    """How many take part in each."""
    rows = (
        select(Entry.competition_id, func.count())
        .where(Entry.competition_id.in_(competitions), Entry.withdrawn.is_(False))
        .group_by(Entry.competition_id)
    )
    return dict(session.execute(rows).all())


def _check_fits(category: Category, words: EntryWords) -> None:
    why = misfit(category, words.gender, words.birth_year)
    if why:
        raise InputError(why, "Choose another category.")

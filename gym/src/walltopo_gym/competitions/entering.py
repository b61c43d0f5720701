"""Entries, bibs, and accepted texts."""

from __future__ import annotations

from collections.abc import Collection
from typing import Any, Final
from uuid import UUID

from sqlalchemy import func, select, update
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.competitions.bodies import EntryBody
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Round,
    ScoreEvent,
    WaiverSignature,
    Wave,
)
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError, RequestError

NO_NAME: Final = "—"


def entry_of(session: Session, row: Competition, entry: UUID) -> Entry:
    """Return an entry of this competition.

    Raises
    ------
    NotFoundError : this competition has no such entry.
    """
    found = session.get(Entry, entry)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("not-there-entry")
    return found


def own_entry(session: Session, row: Competition, person: UUID) -> Entry | None:
    """Return a person's entry; None if they have not entered."""
    mine = select(Entry).where(Entry.competition_id == row.id, Entry.person_id == person)
    return session.scalar(mine)


def add_entry(
    session: Session, row: Competition, words: EntryBody, person: UUID | None = None
) -> Entry:
    """Add a competitor. Without a bib the next free one is given.

    Raises
    ------
    NotFoundError : no such category or wave; RequestError : they do not fit the category;
    ConflictError : bib taken.
    """
    _check_words(session, row, words)
    taken = set(session.scalars(select(Entry.bib).where(Entry.competition_id == row.id)))
    bib = words.bib or next_bib(taken)
    if bib in taken:
        raise ConflictError("cup-bib-taken", bib=bib)
    entry = Entry(
        competition_id=row.id,
        person_id=person,
        withdrawn=False,
        **{**words.model_dump(), "bib": bib},
    )
    session.add(entry)
    row.revision += 1
    session.flush()
    return entry


def change_entry(session: Session, row: Competition, entry: Entry, given: dict[str, Any]) -> None:
    """Change a competitor; omitted fields stay.

    Raises
    ------
    As `add_entry`.
    """
    names = EntryBody.model_fields
    words = EntryBody.model_construct(
        **{name: given.get(name, getattr(entry, name)) for name in names}
    )
    _check_words(session, row, words)
    same = select(Entry.id).where(
        Entry.competition_id == row.id, Entry.bib == words.bib, Entry.id != entry.id
    )
    if session.scalar(same) is not None:
        raise ConflictError("cup-bib-taken", bib=words.bib)
    for name, value in given.items():
        setattr(entry, name, value)
    row.revision += 1
    session.flush()


def enter_person(
    session: Session, row: Competition, words: EntryBody, person: UUID, waiver: str
) -> Entry:
    """Enter a person by their own request, or change their entry. This accepts the text.

    Raises
    ------
    ForbiddenError : the gym enters people itself, or has withdrawn this one.
    ConflictError : entries are closed, the text was changed meanwhile, or the wave has no free
        place or is over.
    RequestError : the competition has waves, and none is chosen.
    """
    if not row.self_entry:
        raise ForbiddenError("cup-gym-enters", "cup-ask-desk")
    if row.state not in ("open", "running"):
        raise ConflictError("cup-no-entry-now")
    if waiver != row.waiver:
        raise ConflictError("cup-text-changed", "cup-read-again")
    entry = own_entry(session, row, person)
    if entry is not None and entry.withdrawn and entry.removed:
        raise ForbiddenError("cup-gym-withdrew", "cup-ask-desk")
    _check_wave(session, row, words.wave_id, entry)
    if entry is None:
        entry = add_entry(session, row, words, person)
    else:
        kept = {"bib": entry.bib, "handicap": entry.handicap}
        if words.category_id != entry.category_id and row.state == "running":
            raise ConflictError("cup-category-stays", "cup-ask-judge")
        change_entry(session, row, entry, {**words.model_dump(), **kept, "withdrawn": False})
    accept_text(session, row, entry, words.name, person, on_paper=False)
    return entry


def waves_of(session: Session, row: Competition) -> list[Wave]:
    """Return the waves of a competition, in order."""
    rows = select(Wave).join(Round, Round.id == Wave.round_id)
    return list(session.scalars(rows.where(Round.competition_id == row.id).order_by(Wave.place)))


def wave_of(session: Session, row: Competition, wave: UUID) -> Wave:
    """Return a wave of this competition.

    Raises
    ------
    NotFoundError : this competition has no such wave.
    """
    found = session.get(Wave, wave)
    if found is None or session.get_one(Round, found.round_id).competition_id != row.id:
        raise NotFoundError("not-there-wave")
    return found


def _check_wave(session: Session, row: Competition, wave: UUID | None, entry: Entry | None) -> None:
    """Check that a person may choose this wave by themselves; one that withdrew in a wave that has
    begun may come back to it.

    Raises
    ------
    RequestError, NotFoundError, ConflictError : they must choose one, it does not exist, is over or
        full, or their own has begun.
    """
    own = None if entry is None else entry.wave_id
    if own is not None and session.get_one(Wave, own).starts_at <= now():
        if own != wave:
            raise ConflictError("cup-wave-stays", "cup-ask-judge")
        return
    if wave is None:
        if row.self_scoring and waves_of(session, row):
            raise RequestError("cup-choose-wave")
        return
    chosen = wave_of(session, row, wave)
    if chosen.ends_at <= now():
        raise ConflictError("cup-wave-over", name=chosen.name)
    taken = select(func.count()).where(Entry.wave_id == wave, Entry.withdrawn.is_(False))
    if entry is not None:
        taken = taken.where(Entry.id != entry.id)
    if chosen.places is not None and (session.scalar(taken) or 0) >= chosen.places:
        raise ConflictError("cup-wave-full", "cup-choose-other-wave", name=chosen.name)


def accept_text(
    session: Session,
    row: Competition,
    entry: Entry,
    signed_by: str,
    person: UUID,
    *,
    on_paper: bool,
) -> None:
    """Record the acceptance of the current text, if the competition has one."""
    if row.waiver:
        session.add(
            WaiverSignature(
                entry_id=entry.id,
                person_id=person,
                on_paper=on_paper,
                signed_by=signed_by,
                text=row.waiver,
            )
        )
        session.flush()


def next_bib(taken: Collection[int]) -> int:
    """Return the number after the highest bib."""
    return max(taken, default=0) + 1


def category_of(session: Session, row: Competition, category: UUID) -> Category:
    """Return a category of this competition.

    Raises
    ------
    NotFoundError : this competition has no such category.
    """
    found = session.get(Category, category)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("not-there-category")
    return found


def misfit(
    category: Category, gender: str, birth_year: int | None, hint: str
) -> RequestError | None:
    """Return why a person does not fit a category, with a hint; None if they fit."""
    if category.gender and gender != category.gender:
        return RequestError("cup-gender", hint, name=category.name)
    bounds = category.born_from, category.born_to
    if bounds == (None, None):
        return None
    if birth_year is None:
        return RequestError("cup-needs-year", hint, name=category.name)
    first, last = bounds[0] or birth_year, bounds[1] or birth_year
    if not first <= birth_year <= last:
        return RequestError("cup-year", hint, year=birth_year, name=category.name)
    return None


def forget_names(session: Session, person: UUID) -> None:
    """Remove a person's name and texts from start lists, signatures and appeals; ranks stay.

    The competitions' revisions grow, so that no kept board shows the name.
    """
    own = select(Entry.id).where(Entry.person_id == person)
    cups = select(Entry.competition_id).where(Entry.person_id == person)
    session.execute(
        update(Competition)
        .where(Competition.id.in_(cups))
        .values(revision=Competition.revision + 1)
    )
    session.execute(
        update(WaiverSignature).where(WaiverSignature.entry_id.in_(own)).values(signed_by=NO_NAME)
    )
    session.execute(update(ScoreEvent).where(ScoreEvent.entry_id.in_(own)).values(text=""))
    session.execute(
        update(ScoreEvent).where(ScoreEvent.person_id == person).values(text="", device="")
    )
    session.execute(
        update(Entry)
        .where(Entry.person_id == person)
        .values(name=NO_NAME, team="", club="", birth_year=None, gender="")
    )


def entries_in(session: Session, competitions: Collection[UUID]) -> dict[UUID, int]:
    """Return the number of competitors by category."""
    rows = (
        select(Entry.competition_id, func.count())
        .where(Entry.competition_id.in_(competitions), Entry.withdrawn.is_(False))
        .group_by(Entry.competition_id)
    )
    return dict(session.execute(rows).all())


def _check_words(session: Session, row: Competition, words: EntryBody) -> None:
    """Check that an entry fits its category, and that the competition has its wave.

    Raises
    ------
    NotFoundError : no such category or wave; RequestError : they do not fit the category.
    """
    category = category_of(session, row, words.category_id)
    problem = misfit(category, words.gender, words.birth_year, "cup-choose-category")
    if problem is not None:
        raise problem
    if words.wave_id is not None:
        wave_of(session, row, words.wave_id)

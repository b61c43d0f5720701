"""Starters of a round and their running order."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from datetime import datetime, timedelta
from secrets import SystemRandom
from uuid import UUID

from sqlalchemy import and_, delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
    Starter,
)
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError


def starters(session: Session, row: Competition, one: Round) -> list[tuple[Entry, int]]:
    """Return the starters of a round, by category and in running order, with positions from 1.

    In an open round, entries without a drawn position come last, by bib.
    """
    own = and_(Starter.entry_id == Entry.id, Starter.round_id == one.id)
    rows = (
        select(Entry)
        .join(Category, Category.id == Entry.category_id)
        .join(Starter, own, isouter=one.quota is None)
        .where(Entry.competition_id == row.id, Entry.withdrawn.is_(False))
        .order_by(Category.place, Starter.place.is_(None), Starter.place, Entry.bib)
    )
    positions = defaultdict[UUID, int](int)
    in_order = []
    for entry in session.scalars(rows):
        positions[entry.category_id] += 1
        in_order.append((entry, positions[entry.category_id]))
    return in_order


def planned_start(one: Round, place: int) -> datetime | None:
    """Return when the competitor of a position, from 1, starts on the first problem; None without a
    rotation."""
    if one.opens_at is None or one.rotation_seconds is None:
        return None
    return one.opens_at + (place - 1) * timedelta(seconds=one.rotation_seconds)


def put_order(
    session: Session, row: Competition, one: Round, category: UUID, entries: Sequence[UUID]
) -> None:
    """Set the running order of a category; with a quota it also sets the starters.

    Raises
    ------
    NotFoundError : no such entry in the category; RequestError : an entry is named twice.
    """
    if len(set(entries)) < len(entries):
        raise RequestError("cup-order-twice")
    there = select(Entry.id).where(
        Entry.competition_id == row.id, Entry.category_id == category, Entry.withdrawn.is_(False)
    )
    of = set(session.scalars(there))
    if not of.issuperset(entries):
        raise NotFoundError("not-there-entry-category")
    session.execute(delete(Starter).where(Starter.round_id == one.id, Starter.entry_id.in_(of)))
    _add_starters(session, row, one, entries)


def draw_order(session: Session, row: Competition, one: Round) -> None:
    """Draw a round's running order: by lot in an open round; with a quota, from the ranks of the
    round before, the best last.

    Raises
    ------
    ConflictError : the round has scores, or the round before has not ended.
    """
    scored = select(func.count()).select_from(ScoreEvent)
    scored = scored.join(Problem, Problem.id == ScoreEvent.problem_id)
    if session.scalar(scored.where(Problem.round_id == one.id)):
        raise ConflictError("cup-scored-in-round", "cup-move-one")
    check_before(session, row, one)
    drawn = _by_lot(session, row) if one.quota is None else _by_rank(session, row, one, one.quota)
    session.execute(delete(Starter).where(Starter.round_id == one.id))
    for entries in drawn:
        _add_starters(session, row, one, entries)


def check_before(session: Session, row: Competition, one: Round) -> None:
    """Check that the round before a quota round is over.

    Raises
    ------
    ConflictError : it is not.
    """
    if one.quota is None:
        return
    of = select(Round.state).where(Round.competition_id == row.id, Round.place < one.place)
    if session.scalar(of.order_by(Round.place.desc()).limit(1)) != "ended":
        raise ConflictError("cup-before-not-ended", "cup-end-first")


def is_drawn(session: Session, one: Round) -> bool:
    """Return whether the round has a running order."""
    of = select(Starter.entry_id).where(Starter.round_id == one.id).limit(1)
    return session.scalar(of) is not None


def forget_drawn(session: Session, row: Competition, after: Round) -> None:
    """Forget the running orders of rounds that have not begun, because a round before them is
    reopened."""
    later = select(Round.id).where(
        Round.competition_id == row.id,
        Round.place > after.place,
        Round.begun_at.is_(None),
        Round.quota.is_not(None),
    )
    session.execute(delete(Starter).where(Starter.round_id.in_(later)))


def _add_starters(session: Session, row: Competition, one: Round, entries: Sequence[UUID]) -> None:
    session.add_all(
        Starter(round_id=one.id, entry_id=entry, place=place)
        for place, entry in enumerate(entries, 1)
    )
    row.revision += 1
    session.flush()


def _by_lot(session: Session, row: Competition) -> Iterable[list[UUID]]:
    entries = select(Entry).where(Entry.competition_id == row.id, Entry.withdrawn.is_(False))
    of = defaultdict[UUID, list[UUID]](list)
    for entry in session.scalars(entries):
        of[entry.category_id].append(entry.id)
    for there in of.values():
        SystemRandom().shuffle(there)
    return of.values()


def _by_rank(session: Session, row: Competition, one: Round, quota: int) -> Iterable[list[UUID]]:
    """Return the best of each category, the best one last. Ties at the end of the quota advance
    too. Equal ranks are ordered by bib."""
    board = board_of(session, row)
    number = [found.id for found in board.sheet.rounds].index(one.id)
    bibs = {who.id: who.bib for who in board.sheet.entries}
    for category, _ in board.sheet.categories:
        ranks = board.ranks_in(board.sheet.rounds[number - 1], category)
        through = [entry for entry, place in ranks.items() if place.rank <= quota]
        yield sorted(through, key=lambda entry: (-ranks[entry].rank, bibs[entry]))

"""A competition and its rounds on their way: opened, begun, ended, frozen."""

from __future__ import annotations

from collections.abc import Sequence
from uuid import UUID

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.clock import now
from walltopo_gym.competitions.history import board_of
from walltopo_gym.competitions.models import Competition, Entry, Round, Starter
from walltopo_gym.errors import ConflictError, NotFoundError

__all__ = ["draw_again", "freeze", "move_competition", "move_round", "round_of", "starters"]


def round_of(session: Session, row: Competition, one: UUID) -> Round:
    """A round of this competition.

    Raises
    ------
    NotFoundError : there is none, or it is another one's.
    """
    found = session.get(Round, one)
    if found is None or found.competition_id != row.id:
        raise NotFoundError("no such round")
    return found


def move_competition(session: Session, row: Competition, state: str) -> None:
    """Go to a state; one that begins to run begins its first round, one that ends ends all.

    Raises
    ------
    ConflictError : back to a draft after somebody has scored.
    """
    if state == "draft" and row.last_seq:
        raise ConflictError("somebody has scored already", "End it instead.")
    row.state = state
    row.revision += 1
    rounds = _rounds(session, row)
    if state == "running" and all(one.state == "waiting" for one in rounds):
        _begin(session, row, rounds[0])
    if state == "ended":
        for one in rounds:
            one.state = "ended" if one.begun_at is not None else one.state
    session.flush()


def move_round(session: Session, row: Competition, one: Round, state: str) -> None:
    """Begin, end or reopen a round, or let it wait again.

    With a quota it draws who is in it when it begins for the first time.

    Raises
    ------
    ConflictError : the competition does not run, or the round before has not ended.
    """
    if row.state != "running":
        raise ConflictError("this competition is not running", "Start it first.")
    row.revision += 1
    if state == "running":
        # Reopened it ends when somebody says so.
        if one.closes_at is not None and one.closes_at <= now():
            one.closes_at = None
        _begin(session, row, one)
        return
    one.state = state
    # What was climbed until now and is still on its way is judged by this moment.
    if state == "ended" and (one.closes_at is None or one.closes_at > now()):
        one.closes_at = now()
    session.flush()


def freeze(session: Session, row: Competition, frozen: bool) -> None:
    """Let the public board stand still from now, or go on."""
    if frozen != (row.frozen_at is not None):
        row.frozen_at = now() if frozen else None
        row.revision += 1
        session.flush()


def starters(session: Session, row: Competition, one: Round) -> list[tuple[Entry, int]]:
    """Who is in a round, by category and in running order, each with their place."""
    if one.quota is None:
        entries = select(Entry).where(Entry.competition_id == row.id, Entry.withdrawn.is_(False))
        found = sorted(session.scalars(entries), key=lambda e: (str(e.category_id), e.bib))
        places: dict[UUID, int] = {}
        told = []
        for entry in found:
            places[entry.category_id] = places.get(entry.category_id, 0) + 1
            told.append((entry, places[entry.category_id]))
        return told
    rows = (
        select(Entry, Starter.place)
        .join(Starter, Starter.entry_id == Entry.id)
        .where(Starter.round_id == one.id)
        .order_by(Entry.category_id, Starter.place)
    )
    return [(entry, place) for entry, place in session.execute(rows)]


def draw_again(
    session: Session, row: Competition, one: Round, category: UUID, entries: Sequence[UUID]
) -> None:
    """Let these be in a round, in this order: of a category, in place of who was.

    Raises
    ------
    ConflictError : all are in this round; NotFoundError : no such entry in the category.
    InputError : somebody stands there twice.
    """
    if one.quota is None:
        raise ConflictError("everybody is in this round", "Give it a quota first.")
    if len(set(entries)) < len(entries):
        raise InputError("somebody stands in the order twice")
    there = select(Entry.id).where(
        Entry.competition_id == row.id, Entry.category_id == category, Entry.withdrawn.is_(False)
    )
    of = set(session.scalars(there))
    if not of.issuperset(entries):
        raise NotFoundError("no such entry in this category")
    session.execute(delete(Starter).where(Starter.round_id == one.id, Starter.entry_id.in_(of)))
    session.add_all(
        Starter(round_id=one.id, entry_id=entry, place=place)
        for place, entry in enumerate(entries, 1)
    )
    row.revision += 1
    session.flush()


def _begin(session: Session, row: Competition, one: Round) -> None:
    rounds = _rounds(session, row)
    before = rounds[: rounds.index(one)]
    if one.quota is not None and before and before[-1].state != "ended":
        raise ConflictError("the round before has not ended", "End it first.")
    if one.quota is not None and one.begun_at is None:
        _draw(session, row, before[-1], one)
    one.state, one.begun_at = "running", one.begun_at or now()
    session.flush()


def _draw(session: Session, row: Competition, before: Round, one: Round) -> None:
    """The best of each category come in, the best one last; who is tied at the quota's end comes
    in, too. Equal ranks start by their bibs."""
    assert one.quota is not None
    board = board_of(session, row)
    sheet = next(found for found in board.sheet.rounds if found.id == before.id)
    bibs = {who.id: who.bib for who in board.sheet.entries}
    session.execute(delete(Starter).where(Starter.round_id == one.id))
    for category, _ in board.sheet.categories:
        ranks = board.ranks_in(sheet, category)
        through = [entry for entry, place in ranks.items() if place.rank <= one.quota]
        through.sort(key=lambda entry: (-ranks[entry].rank, bibs[entry]))
        session.add_all(
            Starter(round_id=one.id, entry_id=entry, place=place)
            for place, entry in enumerate(through, 1)
        )


def _rounds(session: Session, row: Competition) -> list[Round]:
    of = select(Round).where(Round.competition_id == row.id).order_by(Round.place)
    return list(session.scalars(of))

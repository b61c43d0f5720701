"""A competition and its rounds on their way: opened, begun, ended, frozen."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.competitions.models import Competition, Round
from walltopo_gym.competitions.order import check_before, draw, forget_drawn, is_drawn
from walltopo_gym.errors import ConflictError, NotFoundError


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

    With a quota it draws who is in it when it begins for the first time, unless that was done.

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
        forget_drawn(session, row, one)
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


def _begin(session: Session, row: Competition, one: Round) -> None:
    check_before(session, row, one)
    if one.quota is not None and one.begun_at is None and not is_drawn(session, one):
        draw(session, row, one)
    one.state, one.begun_at = "running", one.begun_at or now()
    session.flush()


def _rounds(session: Session, row: Competition) -> list[Round]:
    of = select(Round).where(Round.competition_id == row.id).order_by(Round.place)
    return list(session.scalars(of))

"""The stored score events, and the board that follows from them at any moment."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final
from uuid import UUID

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from walltopo_gym.competitions.board import Leaderboard
from walltopo_gym.competitions.ledger import SCORED, Fact, Ledger
from walltopo_gym.competitions.models import Competition, Problem, Round, ScoreEvent
from walltopo_gym.competitions.scoring.score import NOTHING, Mark
from walltopo_gym.competitions.sheet import load_sheet

_FACT: Final = (
    ScoreEvent.id,
    ScoreEvent.entry_id,
    ScoreEvent.problem_id,
    ScoreEvent.kind,
    ScoreEvent.n,
    ScoreEvent.target_id,
    ScoreEvent.text,
    ScoreEvent.hold,
    ScoreEvent.plus,
    ScoreEvent.seconds,
)


def board_of(session: Session, row: Competition, until: datetime | None = None) -> Leaderboard:
    """Return the board that follows from the events alone.

    Parameters
    ----------
    until : only events that had arrived by then count, on today's sheet; None: all events.
    """
    sheet = load_sheet(session, row)
    if until is None:
        board, last = Leaderboard(sheet), None
    else:
        board, last = Leaderboard(sheet.as_of(until)), seq_at(session, row.id, until)
    catch_up(session, row.id, board, last)
    return board


def seq_at(session: Session, competition: UUID, at: datetime) -> int:
    """Return the number of the last event that had arrived by a moment; 0 without one."""
    arrived = select(ScoreEvent.seq).where(
        ScoreEvent.competition_id == competition, ScoreEvent.at <= at
    )
    return session.scalar(arrived.order_by(ScoreEvent.seq.desc()).limit(1)) or 0


def catch_up(
    session: Session, competition: UUID, board: Leaderboard, last: int | None = None
) -> bool:
    """Add the new events to a board and return whether there were any.

    Parameters
    ----------
    last : number of the last event to add; None: all.
    """
    new = select(ScoreEvent.seq, ScoreEvent.at, *_FACT).where(
        ScoreEvent.competition_id == competition, ScoreEvent.seq > board.seq
    )
    if last is not None:
        new = new.where(ScoreEvent.seq <= last)
    rows = session.execute(new.order_by(ScoreEvent.seq)).all()
    board.results.add(_event_of_columns(row[2:]) for row in rows)
    if rows:
        board.seq, board.at = rows[-1].seq, rows[-1].at
    return bool(rows)


@dataclass(frozen=True)
class Has:
    """A competitor's mark on a problem, and the events that count for it."""

    entry: UUID
    problem: UUID
    mark: Mark
    events: list[UUID]


def marks_of(session: Session, competition: UUID, about: ColumnElement[bool]) -> list[Has]:
    """Return the marks of an entry or a problem.

    Parameters
    ----------
    about : the condition on events; striking events are read in any case.
    """
    facts, ledger = _with_strikers(session, competition, about)
    limits = _attempt_limits(session, competition)
    found = []
    for entry, problem in dict.fromkeys(fact.mark_key for fact in facts):
        if problem is None:
            continue
        mark = ledger.mark(entry, problem, limits.get(problem))
        counting = [one.id for one in ledger.counting_events(entry, problem) if one.kind in SCORED]
        if mark != NOTHING:
            found.append(Has(entry, problem, mark, counting))
    return found


def _attempt_limits(session: Session, competition: UUID) -> dict[UUID, int]:
    """Return the limits of attempts of a competition, by problem."""
    rows = select(Problem.id, Round.max_attempts).join(Round, Round.id == Problem.round_id)
    limited = Round.competition_id == competition, Round.max_attempts.is_not(None)
    return {problem: most for problem, most in session.execute(rows.where(*limited)) if most}


def _event_of_columns(columns: Sequence[Any]) -> Fact:
    """Return an event from its columns, those of `_FACT`."""
    return Fact(*columns)


def struck_events(session: Session, competition: UUID, events: Collection[UUID]) -> set[UUID]:
    """Return which of these events do not count."""
    _, ledger = _with_strikers(session, competition, ScoreEvent.id.in_(events))
    return {event for event in events if not ledger.counts(event)}


def _with_strikers(
    session: Session, competition: UUID, about: ColumnElement[bool]
) -> tuple[list[Fact], Ledger]:
    """Return some events, and a ledger that also has the events that may strike them: an event
    strikes only events of its own competitor."""
    of = select(*_FACT).where(ScoreEvent.competition_id == competition).order_by(ScoreEvent.seq)
    facts = [_event_of_columns(row) for row in session.execute(of.where(about))]
    strikers = of.where(
        ScoreEvent.entry_id.in_({fact.entry for fact in facts}), ScoreEvent.target_id.is_not(None)
    )
    ledger = Ledger()
    ledger.add([*facts, *(_event_of_columns(row) for row in session.execute(strikers))])
    return facts, ledger

"""Score events as they were written, and the board that follows from them, at any moment."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import Session

from walltopo_gym.competitions.board import Board
from walltopo_gym.competitions.ledger import SCORED, Fact, Ledger
from walltopo_gym.competitions.models import Competition, ScoreEvent
from walltopo_gym.competitions.scoring.score import NOTHING, Mark
from walltopo_gym.competitions.sheet import load_sheet

_BATCH: Final = 2_000
_FACT: Final = (
    ScoreEvent.id, ScoreEvent.entry_id, ScoreEvent.problem_id, ScoreEvent.kind, ScoreEvent.n,
    ScoreEvent.target_id, ScoreEvent.text,
)  # fmt: skip


def board_of(session: Session, row: Competition, until: datetime | None = None) -> Board:
    """The board that follows from the events alone.

    Parameters
    ----------
    until : of those that the server had by then, over the sheet of today; None: of all.
    """
    sheet = load_sheet(session, row)
    board = Board(sheet if until is None else sheet.as_of(until))
    catch_up(session, row.id, board, until)
    return board


def catch_up(
    session: Session, competition: UUID, board: Board, until: datetime | None = None
) -> bool:
    """Give a board the events that it has not had yet; whether there were any."""
    before = board.seq
    for seq, at, fact in _facts(session, competition, board.seq, until):
        board.results.add([fact])
        board.seq, board.at = seq, at
    return board.seq > before


def _facts(
    session: Session, competition: UUID, after: int, until: datetime | None
) -> Iterator[tuple[int, datetime, Fact]]:
    rows = select(ScoreEvent.seq, ScoreEvent.at, *_FACT).where(
        ScoreEvent.competition_id == competition, ScoreEvent.seq > after
    )
    if until is not None:
        rows = rows.where(ScoreEvent.at <= until)
    ordered = rows.order_by(ScoreEvent.seq).execution_options(yield_per=_BATCH)
    for row in session.execute(ordered):
        yield row.seq, row.at, Fact(*row[2:])


@dataclass(frozen=True)
class Has:
    """What a competitor has on a problem, and the events that say so and count."""

    entry: UUID
    problem: UUID
    mark: Mark
    events: list[UUID]


def marks_of(session: Session, competition: UUID, about: ColumnElement[bool]) -> list[Has]:
    """What the events of an entry, or of a problem, come to.

    Parameters
    ----------
    about : which; events that strike others are read anyway.
    """
    facts, ledger = _with_strikers(session, competition, about)
    told = []
    for entry, problem in dict.fromkeys(fact.place for fact in facts):
        if problem is None:
            continue
        mark = ledger.mark(entry, problem)
        counting = [one.id for one in ledger.counting(entry, problem) if one.kind in SCORED]
        if mark != NOTHING:
            told.append(Has(entry, problem, mark, counting))
    return told


def struck(session: Session, competition: UUID, events: Collection[UUID]) -> set[UUID]:
    """Which of these events do not count."""
    _, ledger = _with_strikers(session, competition, ScoreEvent.id.in_(events))
    return {event for event in events if not ledger.counts(event)}


def _with_strikers(
    session: Session, competition: UUID, about: ColumnElement[bool]
) -> tuple[list[Fact], Ledger]:
    """Some events, and a ledger of them and of what may strike them: an event strikes those of its
    own competitor alone."""
    of = select(*_FACT).where(ScoreEvent.competition_id == competition).order_by(ScoreEvent.seq)
    facts = [Fact(*row) for row in session.execute(of.where(about))]
    strikers = of.where(
        ScoreEvent.entry_id.in_({fact.entry for fact in facts}), ScoreEvent.target_id.is_not(None)
    )
    ledger = Ledger()
    for fact in (*facts, *(Fact(*row) for row in session.execute(strikers))):
        ledger.add(fact)
    return facts, ledger

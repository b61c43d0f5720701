"""Tables that are counted from ascents (`counting.py`), and the marks that are set by hand.

All but the marks can be made anew from the ascents: `walltopo gym recount`.
"""

from __future__ import annotations

from datetime import date, datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

_PERSON, _GYM = "people.id", "gyms.id"


class SessionMark(Keyed, Base):
    """A session was begun (`kind` "start") or ended ("end") by hand."""

    __tablename__ = "session_marks"
    __table_args__ = (Index("ix_session_marks_of", "person_id", "gym_id", "at"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), index=True)
    kind: Mapped[str] = mapped_column(String(5))
    at: Mapped[datetime]


class ClimbingSession(Keyed, Base):
    """The ascents of one visit: those between `began_at` and `ended_at`, both included.

    `day` is the gym's; `closed`: ended by hand; `tries` of all ascents but projects; `tops` and
    `flashes` count each route once, `points` too; `hardest` is the label of the hardest top.
    """

    __tablename__ = "climbing_sessions"
    __table_args__ = (
        Index("ix_climbing_sessions_of", "person_id", "gym_id", "began_at"),
        Index("ix_climbing_sessions_feed", "gym_id", "began_at"),
    )

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    day: Mapped[date]
    began_at: Mapped[datetime]
    ended_at: Mapped[datetime]
    closed: Mapped[bool]
    ascents: Mapped[int]
    tries: Mapped[int]
    tops: Mapped[int]
    flashes: Mapped[int]
    points: Mapped[int]
    hardest: Mapped[str] = mapped_column(String(80))
    hardest_worth: Mapped[int]


class Standing(Base):
    """Somebody's place in a board before it is known who else is on it.

    `period`: "2026-03", "2026" or "all", by the gym's days; `circuit`: a label of a grade system
    of circuits, or empty for all routes. `points` by `points.py`; `tops` and `flashes` count each
    route once.
    """

    __tablename__ = "standings"
    __table_args__ = (Index("ix_standings_order", "gym_id", "period", "circuit", "points"),)

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    period: Mapped[str] = mapped_column(String(7), primary_key=True)
    circuit: Mapped[str] = mapped_column(String(80), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True, index=True
    )
    points: Mapped[int]
    tops: Mapped[int]
    flashes: Mapped[int]

"""Tables of climbers' own problems, of who climbed them, and of reports."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.climbing.edits import Edited
from walltopo_gym.climbing.sharing import Shared
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.gyms.models import GRADE_BY

_PERSON = "people.id"


class Problem(Edited, Shared, Keyed, Base):
    """A climber's problem. The phone makes `id`, so that it is stored once.

    `holds`: {"hold", "use"} from the first to the last tapped, with the ids of the version
    `scan_id`; `use` is "start", "hand", "foot" or "top". `matching`: both hands may take one
    hold. `remix_of`: the problem that it was made from. `route_id`: the route that a setter made of
    it. `taken_back_at`: deleted; the row stays, so that a late copy does not revive it.
    """

    __tablename__ = "problems"
    __table_args__ = (
        Index("ix_problems_of_wall", "wall_id", "created_at", "id"),
        Index("ix_problems_of_person", "person_id", "wall_id", "created_at"),
    )

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"))
    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    grade_system_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("grade_systems.id", ondelete="SET NULL"), index=True
    )
    grade: Mapped[str] = mapped_column(String(80), default="", info={GRADE_BY: "grade_system_id"})
    matching: Mapped[bool]
    note: Mapped[str] = mapped_column(String(300), default="")
    holds: Mapped[list[dict[str, Any]]] = mapped_column(JSON)
    remix_of: Mapped[UUID | None]
    route_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("routes.id", ondelete="SET NULL"), index=True
    )
    taken_back_at: Mapped[datetime | None]


class ProblemHold(Base):
    """A hold of a problem, for the search by holds; `scan_id` and `hold` as in `Problem`."""

    __tablename__ = "problem_holds"
    __table_args__ = (Index("ix_problem_holds_of_hold", "scan_id", "hold"),)

    problem_id: Mapped[UUID] = mapped_column(
        ForeignKey("problems.id", ondelete="CASCADE"), primary_key=True
    )
    hold: Mapped[int] = mapped_column(primary_key=True)
    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"))


class ProblemAscent(Edited, Base):
    """Whether a person has climbed a problem, and when for the first time."""

    __tablename__ = "problem_ascents"

    problem_id: Mapped[UUID] = mapped_column(
        ForeignKey("problems.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True, index=True
    )
    climbed_at: Mapped[datetime | None]


class ProblemReport(Keyed, Base):
    """A person reports a problem's name or note; deleted when the gym decides.

    `text` is what they read: its author may have changed it since.
    """

    __tablename__ = "problem_reports"
    __table_args__ = (UniqueConstraint("problem_id", "person_id"),)

    problem_id: Mapped[UUID] = mapped_column(ForeignKey("problems.id", ondelete="CASCADE"))
    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"), index=True)
    text: Mapped[str] = mapped_column(String(400))
    reason: Mapped[str] = mapped_column(String(200), default="")

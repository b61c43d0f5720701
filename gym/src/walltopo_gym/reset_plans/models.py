"""Tables of planned resets, of forerunners' proposals, and of signed-off grades."""

from __future__ import annotations

from datetime import date, datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.gyms.models import GRADE_BY, GRADE_ROWS


class ResetPlan(Keyed, Base):
    """A reset of a wall to come. The browser makes `id`, so that it is stored once.

    `wishes`: rows of {"system", "grade", "routes"}, the wished number of routes of each grade.
    `state`: "planned", "set", "forerun" or "published", as the setters chose it; a publication of
    the wall counts, too (`service.plans_of`). `published_at`: when they chose "published".
    """

    __tablename__ = "reset_plans"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    day: Mapped[date]
    note: Mapped[str] = mapped_column(String(500), default="")
    wishes: Mapped[list[dict[str, Any]]] = mapped_column(
        JSON, default=list, info={GRADE_ROWS: ("system", "grade")}
    )
    state: Mapped[str] = mapped_column(String(10))
    published_at: Mapped[datetime | None]


class ResetPerson(Base):
    """A person whom a plan names; `part`: "setter" or "forerunner"."""

    __tablename__ = "reset_people"

    plan_id: Mapped[UUID] = mapped_column(
        ForeignKey("reset_plans.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    part: Mapped[str] = mapped_column(String(10), primary_key=True)


class GradeProposal(Base):
    """A forerunner's proposal for a route: one a person and route, deleted with their account.

    `grade` is a label of the grade system, or empty. `risk`, `intensity`, `complexity`: 1 to 5.
    """

    __tablename__ = "grade_proposals"

    route_id: Mapped[UUID] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    grade_system_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("grade_systems.id", ondelete="SET NULL"), index=True
    )
    grade: Mapped[str] = mapped_column(String(80), default="", info={GRADE_BY: "grade_system_id"})
    risk: Mapped[int | None]
    intensity: Mapped[int | None]
    complexity: Mapped[int | None]
    note: Mapped[str] = mapped_column(String(300), default="")
    changed_at: Mapped[datetime] = mapped_column(default=now)


class SignOff(Base):
    """The agreed grade of a route. After the deletion of the signer's account `person_id` is
    null."""

    __tablename__ = "route_sign_offs"

    route_id: Mapped[UUID] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("people.id", ondelete="SET NULL"), index=True
    )
    grade: Mapped[str] = mapped_column(String(80), info={GRADE_BY: "route_id"})
    signed_at: Mapped[datetime] = mapped_column(default=now)

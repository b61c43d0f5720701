"""Grade systems of a gym."""

from __future__ import annotations

from typing import Any, Literal, Self
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field, model_validator
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.rules import GuestMay, OwnerMay
from walltopo_gym.api.services import Db
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.grades import check_grades
from walltopo_gym.gyms.models import GradeSystem

router = APIRouter(tags=["grades"])


class Grade(Body):
    """One grade; a circuit has a colour and a range in Font or V."""

    label: Name
    colour: str | None = Field(None, pattern=r"^#[0-9a-f]{6}$")
    low: str | None = Field(None, max_length=10)
    high: str | None = Field(None, max_length=10)


class NewGradeSystem(Body):
    """A grade system, from the easiest grade to the hardest."""

    name: Name
    kind: Literal["font", "v", "circuits", "own"]
    grades: list[Grade] = Field(min_length=1, max_length=60)

    @model_validator(mode="after")
    def _make_sense(self) -> Self:
        check_grades(
            self.kind,
            [grade.label for grade in self.grades],
            [(grade.low, grade.high) for grade in self.grades],
        )
        return self

    def rows(self) -> list[dict[str, Any]]:
        """As they are kept."""
        return [grade.model_dump(exclude_none=True) for grade in self.grades]


class GradeSystemFacts(BaseModel):
    """A gym's grade system."""

    id: UUID
    name: str
    kind: str
    grades: list[Grade]


@router.get("/gyms/{gym}/grade-systems")
def list_grade_systems(session: Db, access: GuestMay) -> list[GradeSystemFacts]:
    """How the gym grades its routes."""
    rows = session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == access.gym.id)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    )
    return [_system(row) for row in rows]


@router.post("/gyms/{gym}/grade-systems", status_code=201)
def make_grade_system(body: NewGradeSystem, session: Db, access: OwnerMay) -> GradeSystemFacts:
    """Add a grade system."""
    row = GradeSystem(gym_id=access.gym.id, name=body.name, kind=body.kind, grades=body.rows())
    _refuse_taken(session, access.gym.id, body.name)
    session.add(row)
    session.flush()
    log_change(session, "grades.create", person=access.actor.known, gym=access.gym.id,
               subject=body.name)  # fmt: skip
    return _system(row)


@router.put("/gyms/{gym}/grade-systems/{system}")
def change_grade_system(
    system: UUID, body: NewGradeSystem, session: Db, access: OwnerMay
) -> GradeSystemFacts:
    """Change a grade system."""
    row = _system_of(session, access.gym.id, system)
    if row.name != body.name:
        _refuse_taken(session, access.gym.id, body.name)
    row.name, row.kind, row.grades = body.name, body.kind, body.rows()
    log_change(session, "grades.change", person=access.actor.known, gym=access.gym.id,
               subject=body.name)  # fmt: skip
    return _system(row)


@router.delete("/gyms/{gym}/grade-systems/{system}", status_code=204)
def drop_grade_system(system: UUID, session: Db, access: OwnerMay) -> None:
    """Take a grade system away."""
    row = _system_of(session, access.gym.id, system)
    session.delete(row)
    log_change(session, "grades.delete", person=access.actor.known, gym=access.gym.id,
               subject=row.name)  # fmt: skip


def _system(row: GradeSystem) -> GradeSystemFacts:
    return GradeSystemFacts.model_validate(row, from_attributes=True)


def _system_of(session: Session, gym: UUID, system: UUID) -> GradeSystem:
    row = session.get(GradeSystem, system)
    if row is None or row.gym_id != gym:
        raise NotFoundError("no such grade system")
    return row


def _refuse_taken(session: Session, gym: UUID, name: str) -> None:
    taken = select(GradeSystem.id).where(GradeSystem.gym_id == gym, GradeSystem.name == name)
    if session.scalar(taken) is not None:
        raise ConflictError(f"there is a grade system {name!r} already")

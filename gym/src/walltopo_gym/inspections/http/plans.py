"""Endpoints of a gym's plan of inspections, and of those that are due."""

from __future__ import annotations

from datetime import date
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.fields import Body, Note
from walltopo_gym.api.services import Db
from walltopo_gym.gyms.access import Access, OwnerMay, gym_rule
from walltopo_gym.gyms.days import today
from walltopo_gym.gyms.models import Gym
from walltopo_gym.gyms.roles import Role
from walltopo_gym.inspections.due import LevelDue, due_levels
from walltopo_gym.inspections.levels import Level, LevelPlan, plans_of, store_plans
from walltopo_gym.inspections.models import InspectionPlan
from walltopo_gym.languages import Language

router = APIRouter(tags=["inspections"])

InspectorMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]
Item = Annotated[Note, Field(min_length=1)]


class LevelPlanOut(BaseModel):
    """A level's interval (null: not planned) and the items of its checklist."""

    level: Level
    interval_days: int | None
    checklist: list[str]


class InspectionPlanOut(BaseModel):
    """A gym's plan; while it is not `saved` it is a proposal, and nothing is due."""

    saved: bool
    levels: list[LevelPlanOut]


class LevelPlanIn(Body):
    """A level's interval (null: not planned) and the items of its checklist."""

    level: Level
    interval_days: int | None = Field(ge=1, le=1000)
    checklist: list[Item] = Field(min_length=1, max_length=40)


class InspectionPlanIn(Body):
    """The plan of all levels."""

    levels: list[LevelPlanIn] = Field(min_length=3, max_length=3)


class WallDueOut(BaseModel):
    """The day on which a wall's next inspection of a level is due; `last_on`: of its last one."""

    wall_id: UUID
    name: str
    on: date
    last_on: date | None
    is_due: bool


class LevelDueOut(BaseModel):
    """The walls of a planned level, the first due first."""

    level: Level
    walls: list[WallDueOut]


@router.get("/gyms/{gym}/inspections/plan")
def read_inspection_plan(
    session: Db, access: InspectorMay, language: Language = "en"
) -> InspectionPlanOut:
    """Return the gym's plan of inspections; until one is saved, a proposal in this language."""
    return _plan_out(session, access, language)


@router.put("/gyms/{gym}/inspections/plan")
def put_inspection_plan(body: InspectionPlanIn, session: Db, access: OwnerMay) -> InspectionPlanOut:
    """Set the gym's plan of inspections. Inspections that have begun keep their checklist."""
    plans = [
        LevelPlan(each.level, each.interval_days, tuple(each.checklist)) for each in body.levels
    ]
    store_plans(session, access.gym.id, plans)
    session.flush()
    access.log_change(session, "inspection.plan", subject="")
    return _plan_out(session, access, "en")


@router.get("/gyms/{gym}/inspections/due")
def list_due_inspections(session: Db, access: InspectorMay) -> list[LevelDueOut]:
    """Return when the next inspections are due; empty until the gym has saved a plan."""
    gym = session.get_one(Gym, access.gym.id)
    day = today(gym)
    return [_due_out(level, day) for level in due_levels(session, gym)]


def _due_out(level: LevelDue, day: date) -> LevelDueOut:
    return LevelDueOut(
        level=level.level,
        walls=[
            WallDueOut(
                wall_id=each.wall.id,
                name=each.wall.name,
                on=each.on,
                last_on=each.last,
                is_due=each.on <= day,
            )
            for each in level.walls
        ],
    )


def _plan_out(session: Db, access: Access, language: Language) -> InspectionPlanOut:
    return InspectionPlanOut(
        saved=session.get(InspectionPlan, access.gym.id) is not None,
        levels=[
            LevelPlanOut(
                level=plan.level, interval_days=plan.interval_days, checklist=list(plan.checklist)
            )
            for plan in plans_of(session, access.gym.id, language)
        ],
    )

"""The levels of inspection, and a gym's plan of them.

EN 12572 distinguishes a routine visual, an operational and a main annual inspection.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import StrEnum
from functools import cache
from importlib.resources import files
from typing import Final
from uuid import UUID

import msgspec
from sqlalchemy.orm import Session

from walltopo_gym.errors import RequestError
from walltopo_gym.inspections.models import InspectionPlan
from walltopo_gym.languages import Language


class Level(StrEnum):
    """Levels of inspection, the most frequent first."""

    VISUAL = "visual"
    OPERATIONAL = "operational"
    ANNUAL = "annual"


_DEFAULT_DAYS: Final = {Level.VISUAL: 1, Level.OPERATIONAL: 90, Level.ANNUAL: 365}


@dataclass(frozen=True)
class LevelPlan:
    """A level's interval (None: the gym does not plan it) and the items of its checklist."""

    level: Level
    interval_days: int | None
    checklist: tuple[str, ...]


@cache
def texts_in(language: Language) -> dict[str, str]:
    """Return the texts of records in a language by key."""
    return msgspec.convert(_all_texts()[language]["texts"], dict[str, str])


def default_plans(language: Language) -> list[LevelPlan]:
    """Return the plan of a gym that has saved none, in a language."""
    lists = msgspec.convert(_all_texts()[language]["checklists"], dict[Level, tuple[str, ...]])
    return [LevelPlan(level, _DEFAULT_DAYS[level], lists[level]) for level in Level]


@cache
def _all_texts() -> dict[str, dict[str, object]]:
    content = files("walltopo_gym.inspections").joinpath("texts.json").read_bytes()
    return msgspec.json.decode(content, type=dict[str, dict[str, object]])


def plans_of(session: Session, gym: UUID, language: Language) -> list[LevelPlan]:
    """Return a gym's plan of each level; the default in `language` until it saves one."""
    row = session.get(InspectionPlan, gym)
    return default_plans(language) if row is None else saved_plans(row)


def saved_plans(row: InspectionPlan) -> list[LevelPlan]:
    """Return the plans that a gym has saved."""
    return [
        LevelPlan(Level(each["level"]), each["interval_days"], tuple(each["checklist"]))
        for each in row.levels
    ]


def store_plans(session: Session, gym: UUID, plans: list[LevelPlan]) -> None:
    """Replace a gym's plan.

    Raises
    ------
    RequestError : it lacks a level, or has one twice.
    """
    if sorted(plan.level for plan in plans) != sorted(Level):
        raise RequestError("inspection-levels")
    order = {level: number for number, level in enumerate(Level)}
    rows = [
        {
            "level": plan.level.value,
            "interval_days": plan.interval_days,
            "checklist": list(plan.checklist),
        }
        for plan in sorted(plans, key=lambda plan: order[plan.level])
    ]
    row = session.get(InspectionPlan, gym)
    if row is None:
        session.add(InspectionPlan(gym_id=gym, levels=rows))
    else:
        row.levels = rows

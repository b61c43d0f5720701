"""Compare the current routes with the gym's targets: by grade, by kind of wall, and by both."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.styles import STEEPNESS
from walltopo_gym.errors import RequestError
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.insights.models import WASH_AFTER, Aims
from walltopo_gym.insights.routes import OfRoute


@dataclass(frozen=True)
class GradeTarget:
    """Routes of a grade (empty: any) on a kind of wall (empty: any): the current number and the
    target (None: no target)."""

    system: UUID | None
    grade: str
    colour: str
    steepness: str
    current: int
    target: int | None


@dataclass(frozen=True)
class LackingGrade:
    """Routes of a grade that the target lacks."""

    system: UUID
    grade: str
    routes: int


def aims_of(session: Session, gym: UUID) -> Aims:
    """Return a gym's aims; default ones outside of the session if there are none."""
    return session.get(Aims, gym) or Aims(gym_id=gym, targets=[], stock=[], wash_after=WASH_AFTER)


def check_targets(
    session: Session, gym: UUID, cells: Iterable[tuple[UUID | None, str, str]]
) -> None:
    """Refuse targets with grades or kinds of wall that the gym does not have.

    Parameters
    ----------
    cells : system, grade and kind of wall of each.

    Raises
    ------
    RequestError : names the cell and its fault.
    """
    labels = {system.id: set(system.labels) for system in _systems(session, gym)}
    seen = set()
    for system, grade, steepness in cells:
        if bool(grade) != (system is not None):
            raise RequestError("grade-needs-system")
        if system is not None and grade not in labels.get(system, ()):
            raise RequestError("target-no-grade", grade=grade)
        if not grade and not steepness:
            raise RequestError("target-empty")
        if (system, grade, steepness) in seen:
            raise RequestError("target-twice")
        seen.add((system, grade, steepness))


def grade_targets(
    session: Session, gym: UUID, aims: Aims, routes: Sequence[OfRoute]
) -> list[GradeTarget]:
    """Return rows by grade, then by kind of wall, then by both, without empty ones.

    Targets of grades that were removed from the gym's systems do not count.
    """
    targets = {
        (UUID(cell["system"]) if cell["system"] else None, cell["grade"], cell["steepness"]): int(
            cell["routes"]
        )
        for cell in aims.targets
    }
    current: Counter[tuple[UUID | None, str, str]] = Counter()
    for route in routes:
        graded = (route.system, route.grade) if route.grade else (None, "")
        current.update({(*graded, ""), (None, "", route.steepness), (*graded, route.steepness)})
    grades = [
        (system.id, str(grade["label"]), str(grade.get("colour") or ""))
        for system in _systems(session, gym)
        for grade in system.grades
    ]
    no_grade, kinds = (None, "", ""), tuple(STEEPNESS)
    cells: list[tuple[UUID | None, str, str, str]] = [(*grade, "") for grade in grades]
    cells += [(*no_grade, kind) for kind in kinds]
    cells += [(*grade, kind) for kind in kinds for grade in grades]
    return [
        GradeTarget(
            system,
            grade,
            colour,
            kind,
            current[system, grade, kind],
            targets.get((system, grade, kind)),
        )
        for system, grade, colour, kind in cells
        if current[system, grade, kind] or (system, grade, kind) in targets
    ]


def lacking_grades(rows: Iterable[GradeTarget]) -> list[LackingGrade]:
    """Return what the targets of grades lack, without those of one kind of wall."""
    return [
        LackingGrade(row.system, row.grade, row.target - row.current)
        for row in rows
        if row.system is not None
        and not row.steepness
        and row.target is not None
        and row.target > row.current
    ]


def _systems(session: Session, gym: UUID) -> Sequence[GradeSystem]:
    return session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == gym)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    ).all()

"""What hangs against what the gym wishes: by grade, by kind of wall, and by both."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.climbing.styles import STEEPNESS
from walltopo_gym.gyms.models import GradeSystem
from walltopo_gym.insights.models import WASH_AFTER, Aims
from walltopo_gym.insights.routes import OfRoute


@dataclass(frozen=True)
class Wished:
    """Routes of a grade (empty: of any), on a kind of wall (empty: on any): how many hang, and how
    many are wished; None: nothing was wished."""

    system: UUID | None
    grade: str
    colour: str
    steepness: str
    hanging: int
    wish: int | None


def aims_of(session: Session, gym: UUID) -> Aims:
    """What a gym has said; where it has not, the silent row, which is in no session."""
    return session.get(Aims, gym) or Aims(gym_id=gym, wish=[], stock=[], wash_after=WASH_AFTER)


def check_wish(session: Session, gym: UUID, cells: Iterable[tuple[UUID | None, str, str]]) -> None:
    """Refuse wishes for what the gym does not have.

    Parameters
    ----------
    cells : system, grade and kind of wall of each.

    Raises
    ------
    InputError : says which, and what is wrong with it.
    """
    labels = {system.id: {g["label"] for g in system.grades} for system in _systems(session, gym)}
    seen = set()
    for system, grade, steepness in cells:
        if bool(grade) != (system is not None):
            raise InputError("a grade needs its grade system")
        if system is not None and grade not in labels.get(system, ()):
            raise InputError(f"the gym has no grade {grade!r}")
        if not grade and not steepness:
            raise InputError("a wish needs a grade or a kind of wall")
        if (system, grade, steepness) in seen:
            raise InputError("a wish is there twice")
        seen.add((system, grade, steepness))


def wished(session: Session, gym: UUID, aims: Aims, routes: Sequence[OfRoute]) -> list[Wished]:
    """By grade, then by kind of wall, then by both; what neither hangs nor is wished is left out.

    Of grades that the gym has no more a wish does not count.
    """
    wish = {
        (UUID(cell["system"]) if cell["system"] else None, cell["grade"], cell["steepness"]):
            int(cell["routes"])
        for cell in aims.wish
    }  # fmt: skip
    hanging: Counter[tuple[UUID | None, str, str]] = Counter()
    for route in routes:
        graded = (route.system, route.grade) if route.grade else (None, "")
        hanging.update({(*graded, ""), (None, "", route.steepness), (*graded, route.steepness)})
    grades = [
        (system.id, str(grade["label"]), str(grade.get("colour") or ""))
        for system in _systems(session, gym) for grade in system.grades
    ]  # fmt: skip
    no_grade, kinds = (None, "", ""), tuple(STEEPNESS)
    cells: list[tuple[UUID | None, str, str, str]] = [(*grade, "") for grade in grades]
    cells += [(*no_grade, kind) for kind in kinds]
    cells += [(*grade, kind) for kind in kinds for grade in grades]
    return [
        Wished(system, grade, colour, kind, hanging[system, grade, kind],
               wish.get((system, grade, kind)))
        for system, grade, colour, kind in cells
        if hanging[system, grade, kind] or (system, grade, kind) in wish
    ]  # fmt: skip


def _systems(session: Session, gym: UUID) -> Sequence[GradeSystem]:
    return session.scalars(
        select(GradeSystem)
        .where(GradeSystem.gym_id == gym)
        .order_by(GradeSystem.created_at, GradeSystem.id)
    ).all()

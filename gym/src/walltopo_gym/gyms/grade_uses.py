"""Grades in use: renames carry over, and no grade goes while something has it.

Each table with the columns `grade_system_id` and `grade` uses grades: routes, problems, proposals
of forerunners. The tables belong to slices above this one and are therefore found by their columns.
Ascents keep the grade of their day.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from uuid import UUID

from sqlalchemy import Table, Update, case, func, select, update
from sqlalchemy.orm import Session

from walltopo_gym.database.base import Base
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.models import GradeSystem

_COLUMNS = {"grade_system_id", "grade"}
# Tables whose grades are of the system of their row's route.
_OF_ROUTES = ("opinions", "route_sign_offs")


def change_labels(
    session: Session, system: GradeSystem, labels: Sequence[str], renamed: Mapping[str, str]
) -> None:
    """Carry renames over to all that has the grades; call it before the system's own change.

    Parameters
    ----------
    labels : the system's new ones.
    renamed : new label by old label.

    Raises
    ------
    ConflictError : a label that goes is in use and not renamed, or a new label does not exist.
    """
    missing = sorted(set(renamed.values()) - set(labels))
    if missing:
        raise ConflictError("grades-rename-to", grade=missing[0])
    used = _uses(session, system.id)
    lost = sorted(used.keys() - set(labels) - renamed.keys())
    if lost:
        raise ConflictError("grades-in-use", "grades-say-new", grade=lost[0], uses=used[lost[0]])
    changed = {old: new for old, new in renamed.items() if old != new}
    if not changed:
        return
    for table in _tables():
        there = table.c.grade_system_id == system.id, table.c.grade.in_(changed)
        session.execute(_rename(table, changed).where(*there))
    routes = Base.metadata.tables["routes"]
    of_system = select(routes.c.id).where(routes.c.grade_system_id == system.id)
    for name in _OF_ROUTES:
        table = Base.metadata.tables[name]
        there = table.c.route_id.in_(of_system), table.c.grade.in_(changed)
        session.execute(_rename(table, changed).where(*there))


def replace_system(session: Session, system: GradeSystem, by: GradeSystem | None) -> None:
    """Give all that has a grade of a system the same grade of another one.

    Raises
    ------
    ConflictError : grades are in use and there is no replacement, or it lacks one of them.
    """
    used = _uses(session, system.id)
    if not used:
        return
    if by is None:
        raise ConflictError(
            "grades-system-in-use", "grades-replace", name=system.name, uses=used.total()
        )
    known = {str(grade["label"]).casefold(): str(grade["label"]) for grade in by.grades}
    lost = sorted(label for label in used if label.casefold() not in known)
    if lost:
        raise ConflictError("grades-not-there", "grades-add-it", grade=lost[0], name=by.name)
    labels = {label: known[label.casefold()] for label in used}
    change_labels(session, system, list(labels.values()), labels)
    for table in _tables():
        there = table.c.grade_system_id == system.id
        session.execute(update(table).where(there).values(grade_system_id=by.id))


def _tables() -> list[Table]:
    return [table for table in Base.metadata.sorted_tables if set(table.c.keys()) >= _COLUMNS]


def _uses(session: Session, system: UUID) -> Counter[str]:
    """Return how many rows have each grade of a system."""
    found: Counter[str] = Counter()
    for table in _tables():
        rows = (
            select(table.c.grade, func.count())
            .where(table.c.grade_system_id == system, table.c.grade != "")
            .group_by(table.c.grade)
        )
        found.update({str(label): int(count) for label, count in session.execute(rows)})
    return found


def _rename(table: Table, changed: Mapping[str, str]) -> Update:
    return update(table).values(grade=case(changed, value=table.c.grade, else_=table.c.grade))

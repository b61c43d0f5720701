"""Grades in use: renames carry over, and no grade goes while something has it.

Slices above this one mark their columns of grades (`GRADE_BY`, `GRADE_ROWS` in gyms/models.py).
Ascents and problems of competitions keep the grade of their day: their columns have no mark.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from typing import Any, NamedTuple
from uuid import UUID

from sqlalchemy import Column, ColumnElement, String, case, cast, func, select, update
from sqlalchemy.orm import Session

from walltopo_gym.database.base import Base
from walltopo_gym.errors import ConflictError
from walltopo_gym.gyms.grade_labels import own_label
from walltopo_gym.gyms.models import GRADE_BY, GRADE_ROWS, GradeSystem


class _Use(NamedTuple):
    """A column with grades, and which of its rows have grades of the system in question.

    `system` is the row's own column of the system; None if the system is its route's.
    """

    column: Column[Any]
    there: ColumnElement[bool]
    system: Column[Any] | None


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
    used = _count_uses(session, system.id)
    lost = sorted(used.keys() - set(labels) - renamed.keys())
    if lost:
        raise ConflictError("grades-in-use", "grades-say-new", grade=lost[0], uses=used[lost[0]])
    changed = {old: new for old, new in renamed.items() if old != new}
    if not changed:
        return
    for column, there, _ in _uses(system.id):
        label = case(changed, value=column, else_=column)
        has_one = column.in_(changed)
        session.execute(update(column.table).where(there, has_one).values({column: label}))
    _change_rows(session, system.id, system.id, changed)


def replace_system(session: Session, system: GradeSystem, by: GradeSystem | None) -> None:
    """Give all that has a grade of a system the same grade of another one.

    Raises
    ------
    ConflictError : grades are in use and there is no replacement, or it lacks one of them.
    """
    used = _count_uses(session, system.id)
    if not used:
        return
    if by is None:
        raise ConflictError(
            "grades-system-in-use", "grades-replace", name=system.name, uses=used.total()
        )
    known = {label: own_label(by.kind, by.labels, label) for label in used}
    lost = sorted(label for label, new in known.items() if new is None)
    if lost:
        raise ConflictError("grades-not-there", "grades-add-it", grade=lost[0], name=by.name)
    labels = {label: new for label, new in known.items() if new is not None}
    change_labels(session, system, list(labels.values()), labels)
    _change_rows(session, system.id, by.id, {})
    for column, there, own in _uses(system.id):
        if own is not None:
            session.execute(update(column.table).where(there).values({own: by.id}))


def _uses(system: UUID) -> Iterator[_Use]:
    for column in _columns_with(GRADE_BY):
        by = column.table.c[column.info[GRADE_BY]]
        key = next(iter(by.foreign_keys)).column
        if key.table is GradeSystem.__table__:
            yield _Use(column, by == system, by)
        else:
            of_system = select(key).where(key.table.c.grade_system_id == system)
            yield _Use(column, by.in_(of_system), None)


def _columns_with(mark: str) -> Iterator[Column[Any]]:
    for table in Base.metadata.sorted_tables:
        yield from (column for column in table.c if mark in column.info)


def _count_uses(session: Session, system: UUID) -> Counter[str]:
    """Return how many rows have each grade of a system."""
    found: Counter[str] = Counter()
    for column, there, _ in _uses(system):
        rows = select(column, func.count()).where(there, column != "").group_by(column)
        found.update({str(label): int(count) for label, count in session.execute(rows)})
    return found


def _change_rows(session: Session, system: UUID, by: UUID, changed: Mapping[str, str]) -> None:
    """Rename the grades of a system inside of JSON, and set the system to `by`."""
    for column in _columns_with(GRADE_ROWS):
        keys = list(column.table.primary_key)
        there = cast(column, String).contains(str(system))
        for *key, value in session.execute(select(*keys, column).where(there)).all():
            rows = _renamed_json(value, column.info[GRADE_ROWS], (str(system), str(by)), changed)
            this = [name == part for name, part in zip(keys, key, strict=True)]
            session.execute(update(column.table).where(*this).values({column: rows}))
    session.expire_all()


def _renamed_json(
    value: Any, names: tuple[str, str], systems: tuple[str, str], changed: Mapping[str, str]
) -> Any:
    """Return JSON with the grades of the first system renamed and given to the second one.

    Parameters
    ----------
    names : the keys of system and grade.
    """
    if isinstance(value, list):
        return [_renamed_json(one, names, systems, changed) for one in value]
    if not isinstance(value, dict):
        return value
    found = {key: _renamed_json(one, names, systems, changed) for key, one in value.items()}
    system, grade = names
    if found.get(system) == systems[0]:
        found[system] = systems[1]
        found[grade] = changed.get(found.get(grade, ""), found.get(grade, ""))
    return found

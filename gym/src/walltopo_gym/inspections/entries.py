"""Marks of items of the checklist and of holds.

Several people may work on one inspection, some of them without reception. All entries are kept; the
latest one of an item or hold counts. Phones send the age of an entry, so a wrong clock moves none.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from enum import StrEnum
from typing import Final
from uuid import UUID

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.climbing.edits import Edit
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, RequestError
from walltopo_gym.events import HoldMarked, publish_event
from walltopo_gym.inspections.models import InspectedWall, Inspection, InspectionEntry

MAX_ENTRIES: Final = 5000  # of an inspection


class ItemMark(StrEnum):
    """Results of an item of the checklist at a wall."""

    FINE = "fine"
    DEFECT = "defect"
    UNCHECKED = "unchecked"


class HoldMark(StrEnum):
    """Results of a hold, by what was done to it. None of them is about torque or cracks."""

    FINE = "fine"
    TIGHTENED = "tightened"
    WASHED = "washed"
    REMOVED = "removed"


@dataclass(frozen=True)
class Mark:
    """A mark as it is sent: of `item` or of `hold`; the other one is None.

    Parameters
    ----------
    photo : the hash of a stored photo, or None. edit : its origin; None: of a program, now.
    """

    wall: UUID
    item: int | None
    hold: int | None
    mark: ItemMark | HoldMark
    note: str
    photo: str | None
    edit: Edit | None


def store_entry(
    session: Session,
    inspection: Inspection,
    entry: UUID,
    person: UUID,
    given: Mark,
    holds: Collection[int],
) -> tuple[InspectionEntry, bool]:
    """Store an entry; return it and whether it is new. Sent again, it is there once.

    After the inspection is finished an entry is kept as late, and changes nothing else of it.

    Parameters
    ----------
    inspection : locked. holds : ids of the holds in the wall's version.

    Raises
    ------
    RequestError : the inspection has no such wall, item or hold. ConflictError : the id belongs to
        another inspection or person, or the inspection is full.
    """
    known = session.get(InspectionEntry, entry)
    if known is not None:
        if known.inspection_id != inspection.id or known.person_id != person:
            raise ConflictError("id-taken", "id-another")
        return known, False
    inspected = session.get(InspectedWall, (inspection.id, given.wall))
    _check_mark(inspection, inspected, given, holds)
    count = select(func.count()).where(InspectionEntry.inspection_id == inspection.id)
    if (session.scalar(count) or 0) >= MAX_ENTRIES:
        raise ConflictError("inspection-full", "inspection-begin-another", most=MAX_ENTRIES)
    row = InspectionEntry(
        id=entry,
        inspection_id=inspection.id,
        wall_id=given.wall,
        scan_id=None if given.hold is None or inspected is None else inspected.scan_id,
        person_id=person,
        item=given.item,
        hold=given.hold,
        mark=given.mark.value,
        note=given.note,
        photo=given.photo,
        made_at=_made_at(session, inspection, given.edit),
        device=None if given.edit is None else given.edit.device,
        number=None if given.edit is None else given.edit.number,
        late=inspection.finished_at is not None,
    )
    session.add(row)
    session.flush()
    if row.hold is not None and row.scan_id is not None:
        publish_event(
            session,
            HoldMarked(
                inspection.gym_id, row.wall_id, row.scan_id, row.hold, row.mark, row.made_at, person
            ),
        )
    return row, True


def _made_at(session: Session, inspection: Inspection, edit: Edit | None) -> datetime:
    """Return when an entry was made: never before its inspection began, and between the entries of
    its phone that were made before and after it, because each was on its way for another time."""
    at = now()
    if edit is None:
        return at
    of_phone = select(InspectionEntry.made_at).where(
        InspectionEntry.inspection_id == inspection.id, InspectionEntry.device == edit.device
    )
    before = of_phone.where(InspectionEntry.number < edit.number)
    after = of_phone.where(InspectionEntry.number > edit.number)
    made = max(inspection.created_at, at - timedelta(seconds=edit.age_s))
    first = session.scalar(before.order_by(InspectionEntry.number.desc()).limit(1))
    last = session.scalar(after.order_by(InspectionEntry.number).limit(1))
    made = made if first is None else max(first, made)
    return made if last is None else min(last, made)


def _check_mark(
    inspection: Inspection, inspected: InspectedWall | None, given: Mark, holds: Collection[int]
) -> None:
    """Refuse a mark of nothing that is inspected.

    Raises
    ------
    RequestError : says what is unknown.
    """
    if inspected is None:
        raise RequestError("inspection-wall-unknown")
    if given.hold is None:
        if given.item is None or given.item >= len(inspection.checklist):
            raise RequestError("inspection-item-unknown")
        if not isinstance(given.mark, ItemMark):
            raise RequestError("inspection-mark-unknown")
        if given.mark == ItemMark.DEFECT and not given.note:
            raise RequestError("inspection-defect-note")
        return
    if given.item is not None or not isinstance(given.mark, HoldMark):
        raise RequestError("inspection-mark-unknown")
    if given.hold not in holds:
        raise RequestError("hold-unknown")


def entries_of(
    session: Session, inspection: UUID, *, late: bool | None = None
) -> Sequence[InspectionEntry]:
    """Return the entries of an inspection, the first made first.

    Parameters
    ----------
    late : only those that came after its end, or before it; None: all.
    """
    rows = select(InspectionEntry).where(InspectionEntry.inspection_id == inspection)
    if late is not None:
        rows = rows.where(InspectionEntry.late.is_(late))
    order = (
        InspectionEntry.made_at,
        InspectionEntry.number,
        InspectionEntry.created_at,
        InspectionEntry.id,
    )
    return session.scalars(rows.order_by(*order)).all()


def late_entries(session: Session, inspection: UUID) -> int:
    """Return the number of entries that came after the end of an inspection."""
    rows = select(func.count()).where(
        InspectionEntry.inspection_id == inspection, InspectionEntry.late.is_(True)
    )
    return session.scalar(rows) or 0

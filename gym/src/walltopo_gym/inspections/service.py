"""Begin, discard and find inspections."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.inspections.levels import Level, LevelPlan
from walltopo_gym.inspections.models import InspectedWall, Inspection
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

MAX_WALLS: Final = 100
_MAX_OPEN: Final = 20  # unfinished inspections of a gym


def begin_inspection(
    session: Session,
    gym: UUID,
    person: UUID,
    plan: LevelPlan,
    walls: Sequence[UUID],
    corrects: UUID | None,
) -> Inspection:
    """Begin an inspection of some walls in their published versions.

    Parameters
    ----------
    corrects : the finished inspection that it corrects, perhaps with walls that are gone.

    Raises
    ------
    NotFoundError : this gym has no such wall or inspection. RequestError : a wall comes twice, or
        the corrected inspection is not finished or of another level. ConflictError : too many
        inspections are unfinished.
    """
    if len(set(walls)) < len(walls):
        raise RequestError("inspection-wall-twice")
    if len(open_inspections(session, gym)) >= _MAX_OPEN:
        raise ConflictError("inspections-open", "inspections-finish-some", most=_MAX_OPEN)
    known: dict[UUID, InspectedWall] = {}
    if corrects is not None:
        corrected = inspection_of(session, gym, corrects)
        if corrected.finished_at is None or corrected.level != plan.level:
            raise RequestError("inspection-corrects")
        known = {row.wall_id: row for row in inspected_walls(session, corrects)}
    row = Inspection(
        gym_id=gym,
        level=plan.level.value,
        checklist=list(plan.checklist),
        person_id=person,
        corrects_id=corrects,
    )
    session.add(row)
    session.flush()
    session.add_all(_inspected_wall(session, row, each, known.get(each)) for each in walls)
    session.flush()
    return row


def _inspected_wall(
    session: Session, inspection: Inspection, wall: UUID, known: InspectedWall | None
) -> InspectedWall:
    """Return the row of a wall: as it is now, or of the corrected inspection if it is gone.

    Raises
    ------
    NotFoundError : this gym has no such wall.
    """
    if known is not None and session.get(Wall, wall) is None:
        scan, name, place = known.scan_id, known.name, known.place
    else:
        present = wall_of(session, inspection.gym_id, wall)
        scan, name, place = present.published_scan_id, present.name, present.place
    return InspectedWall(
        inspection_id=inspection.id, wall_id=wall, scan_id=scan, name=name, place=place
    )


def inspections_of(gym: UUID, level: Level | None = None) -> Select[Inspection]:
    """Return the query of a gym's inspections."""
    rows: Select[Inspection] = select(Inspection).where(Inspection.gym_id == gym)
    return rows if level is None else rows.where(Inspection.level == level)


def open_inspections(session: Session, gym: UUID) -> Sequence[Inspection]:
    """Return the unfinished inspections of a gym, the first begun first."""
    rows = inspections_of(gym).where(Inspection.finished_at.is_(None))
    return session.scalars(rows.order_by(Inspection.created_at)).all()


def inspection_of(
    session: Session, gym: UUID, inspection: UUID, *, locked: bool = False
) -> Inspection:
    """Return an inspection of this gym.

    Parameters
    ----------
    locked : no other transaction changes it until the end of this one.

    Raises
    ------
    NotFoundError : this gym has no such inspection.
    """
    rows = inspections_of(gym).where(Inspection.id == inspection)
    row = session.scalar(rows.with_for_update() if locked else rows)
    if row is None:
        raise NotFoundError("not-there-inspection")
    return row


def inspected_walls(session: Session, inspection: UUID) -> Sequence[InspectedWall]:
    """Return the walls of an inspection from left to right."""
    rows = select(InspectedWall).where(InspectedWall.inspection_id == inspection)
    return session.scalars(rows.order_by(InspectedWall.place, InspectedWall.name)).all()


def discard_inspection(session: Session, inspection: Inspection) -> None:
    """Delete an unfinished inspection with its entries.

    Raises
    ------
    ConflictError : it is finished.
    """
    if inspection.finished_at is not None:
        raise ConflictError("inspection-finished", "inspection-correct")
    session.delete(inspection)

"""Endpoints of inspections: begin, list, read, finish and discard."""

from __future__ import annotations

import json
from collections import defaultdict
from collections.abc import Sequence
from datetime import datetime
from typing import Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.api.fields import Body, LongText
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.gyms.access import Access, SetterMay
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.entries import entries_of
from walltopo_gym.inspections.http.plans import InspectorMay
from walltopo_gym.inspections.levels import Level, plans_of
from walltopo_gym.inspections.models import InspectedWall, Inspection
from walltopo_gym.inspections.record import (
    Result,
    entry_facts,
    finish_inspection,
    names_of,
)
from walltopo_gym.inspections.service import (
    MAX_WALLS,
    begin_inspection,
    discard_inspection,
    inspected_walls,
    inspection_of,
    inspections_of,
)
from walltopo_gym.inspections.signing import key_name
from walltopo_gym.languages import Language

router = APIRouter(tags=["inspections"])


class NewInspection(Body):
    """An inspection of walls by the checklist of a level, in `language` while the gym has no plan
    of its own; `corrects_id`: the finished inspection that it corrects."""

    level: Level
    walls: list[UUID] = Field(min_length=1, max_length=MAX_WALLS)
    corrects_id: UUID | None = None
    language: Language = "en"


class InspectionEnd(Body):
    """How an inspection ended."""

    result: Result
    remarks: str = Field("", max_length=2000, pattern=LongText)


class InspectionOut(BaseModel):
    """An inspection in a list: its walls by name, and its people, empty after the deletion of their
    accounts. `result` and `code` are null while it is not finished."""

    id: UUID
    level: Level
    walls: list[str]
    created_at: datetime
    started_by: str
    finished_at: datetime | None
    finished_by: str
    result: Result | None
    corrects_id: UUID | None
    code: str | None


class InspectedWallOut(BaseModel):
    """A wall of an inspection, and the version that has the ids of the marked holds."""

    id: UUID
    name: str
    scan_id: UUID | None


class InspectionEntryOut(BaseModel):
    """A mark of an item of the checklist (its number from 0) or of a hold at a wall. `by`: a name.
    `late`: it arrived after the inspection was finished, and is no part of its record."""

    id: UUID
    wall_id: UUID
    item: int | None
    hold: int | None
    mark: str
    note: str
    photo: str | None
    at: datetime
    by: str
    late: bool


class InspectionFull(BaseModel):
    """An inspection with all of its entries, the first made first; the latest one of an item or
    hold counts. A finished inspection is shown as it was signed, with late entries added.

    `key`: short name of the key that signed it. `corrected_by`: the inspections that correct it.
    """

    id: UUID
    level: Level
    checklist: list[str]
    walls: list[InspectedWallOut]
    created_at: datetime
    started_by: str
    finished_at: datetime | None
    finished_by: str
    result: Result | None
    remarks: str
    corrects_id: UUID | None
    corrected_by: list[UUID]
    code: str | None
    key: str
    entries: list[InspectionEntryOut]


@router.post("/gyms/{gym}/inspections", status_code=201)
def make_inspection(body: NewInspection, session: Db, access: SetterMay) -> InspectionFull:
    """Begin an inspection."""
    gym = access.gym.id
    plan = next(plan for plan in plans_of(session, gym, body.language) if plan.level == body.level)
    row = begin_inspection(session, gym, access.actor.known, plan, body.walls, body.corrects_id)
    _log_inspection(session, access, "inspection.begin", row)
    return _inspection_out(session, row)


@router.get("/gyms/{gym}/inspections")
def list_inspections(
    session: Db,
    access: InspectorMay,
    level: Level | None = None,
    cursor: Cursor = None,
    size: Size = 50,
) -> Page[InspectionOut]:
    """Return the gym's inspections, the last begun first."""
    rows, following = page_of(
        session, inspections_of(access.gym.id, level), Inspection, cursor, size
    )
    return Page(items=_listed_inspections(session, rows), next=following)


@router.get("/gyms/{gym}/inspections/{inspection}")
def read_inspection(inspection: UUID, session: Db, access: InspectorMay) -> InspectionFull:
    """Return an inspection with its entries."""
    return _inspection_out(session, inspection_of(session, access.gym.id, inspection))


@router.post("/gyms/{gym}/inspections/{inspection}/finish")
def end_inspection(
    inspection: UUID, body: InspectionEnd, session: Db, access: SetterMay
) -> InspectionFull:
    """Finish an inspection: its record is signed in one's name, and never changes."""
    row = inspection_of(session, access.gym.id, inspection, locked=True)
    gym = session.get_one(Gym, access.gym.id)
    finish_inspection(session, gym, row, access.actor.known, body.result, body.remarks)
    _log_inspection(session, access, "inspection.finish", row)
    return _inspection_out(session, row)


@router.delete("/gyms/{gym}/inspections/{inspection}", status_code=204)
def drop_inspection(inspection: UUID, session: Db, access: SetterMay) -> None:
    """Discard an unfinished inspection with its entries."""
    row = inspection_of(session, access.gym.id, inspection, locked=True)
    discard_inspection(session, row)
    _log_inspection(session, access, "inspection.discard", row)


def _log_inspection(session: Session, access: Access, action: str, row: Inspection) -> None:
    access.log_change(
        session,
        action,
        subject=str(row.id),
        level=row.level,
    )


def _listed_inspections(session: Session, rows: Sequence[Inspection]) -> list[InspectionOut]:
    ids = [row.id for row in rows]
    walls: defaultdict[UUID, list[str]] = defaultdict(list)
    inspected = (
        select(InspectedWall.inspection_id, InspectedWall.name)
        .where(InspectedWall.inspection_id.in_(ids))
        .order_by(InspectedWall.place, InspectedWall.name)
    )
    for inspection, name in session.execute(inspected):
        walls[inspection].append(name)
    names = names_by_id(session, [one for row in rows for one in (row.person_id, row.finished_by)])
    return [
        InspectionOut(
            id=row.id,
            level=Level(row.level),
            walls=walls[row.id],
            created_at=row.created_at,
            started_by=names.get(row.person_id, ""),
            finished_at=row.finished_at,
            finished_by=names.get(row.finished_by, ""),
            result=Result(row.result) if row.result else None,
            corrects_id=row.corrects_id,
            code=row.code,
        )
        for row in rows
    ]


def _inspection_out(session: Session, row: Inspection) -> InspectionFull:
    facts = _signed_facts(row) if row.record else _present_facts(session, row)
    late = entries_of(session, row.id, late=True)
    names = names_of(session, row, late)
    corrections = select(Inspection.id).where(Inspection.corrects_id == row.id)
    return InspectionFull(
        id=row.id,
        level=Level(row.level),
        checklist=row.checklist,
        created_at=row.created_at,
        finished_at=row.finished_at,
        result=Result(row.result) if row.result else None,
        remarks=row.remarks,
        corrects_id=row.corrects_id,
        corrected_by=list(session.scalars(corrections.order_by(Inspection.created_at))),
        code=row.code,
        key=key_name(row.public_key) if row.public_key else "",
        walls=facts["walls"],
        started_by=facts["started_by"],
        finished_by=facts["finished_by"],
        entries=[
            *(InspectionEntryOut(**entry, late=False) for entry in facts["entries"]),
            *(InspectionEntryOut(**entry_facts(entry, names), late=True) for entry in late),
        ],
    )


def _signed_facts(row: Inspection) -> dict[str, Any]:
    """Return walls, people and entries as they were signed."""
    record = json.loads(row.record)
    return {
        "walls": record["walls"],
        "started_by": record["started"]["by"],
        "finished_by": record["finished"]["by"],
        "entries": record["entries"],
    }


def _present_facts(session: Session, row: Inspection) -> dict[str, Any]:
    """Return walls, people and entries of an unfinished inspection."""
    entries = entries_of(session, row.id, late=False)
    names = names_of(session, row, entries)
    walls = inspected_walls(session, row.id)
    return {
        "walls": [
            InspectedWallOut(id=wall.wall_id, name=wall.name, scan_id=wall.scan_id)
            for wall in walls
        ],
        "started_by": names.get(row.person_id, ""),
        "finished_by": "",
        "entries": [entry_facts(entry, names) for entry in entries],
    }

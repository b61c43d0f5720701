"""Scans of a wall: begun, started, watched, ended."""

from __future__ import annotations

from collections.abc import AsyncIterator
from dataclasses import dataclass
from datetime import datetime
from typing import Annotated
from uuid import UUID

from anyio import sleep, to_thread
from fastapi import APIRouter, Depends, Request
from fastapi.sse import EventSourceResponse
from pydantic import BaseModel
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.gyms.roles import Role
from walltopo_gym.scans.asking import begin, start
from walltopo_gym.scans.models import Scan, ScanProgress
from walltopo_gym.scans.states import State, move

router = APIRouter(tags=["scans"])

UploaderMay = Annotated[Access, gym_rule(Role.SETTER, Scope.UPLOAD)]

_WATCH_S = 0.5


class Progress(BaseModel):
    """How far a running scan is: in words, and in numbers where they are known."""

    stage: str
    doing: str
    done: int
    total: int | None
    notes: list[str]
    at: datetime


class ScanFacts(BaseModel):
    """One version of a wall; `error` and `hint` say why it failed and what to do."""

    id: UUID
    wall_id: UUID
    state: State
    reference_id: UUID | None
    error: str
    hint: str
    created_at: datetime
    published_at: datetime | None
    progress: Progress | None = None


def scan_of(session: Session, gym: UUID, scan: UUID) -> Scan:
    """A scan of this gym.

    Raises
    ------
    NotFoundError : there is none, or it is another gym's.
    """
    found = select(Scan).join(Wall, Wall.id == Scan.wall_id)
    row = session.scalar(found.where(Scan.id == scan, Wall.gym_id == gym))
    if row is None:
        raise NotFoundError("no such scan")
    return row


def facts_of(session: Session, row: Scan) -> ScanFacts:
    """A scan as it is told, with its progress."""
    facts = ScanFacts.model_validate(row, from_attributes=True)
    progress = session.get(ScanProgress, row.id)
    if progress is not None:
        facts.progress = Progress.model_validate(progress, from_attributes=True)
    return facts


@router.get("/gyms/{gym}/walls/{wall}/scans")
def list_scans(
    wall: UUID, session: Db, access: UploaderMay, cursor: Cursor = None, size: Size = 50
) -> Page[ScanFacts]:
    """The wall's versions, the newest first."""
    wall_of(session, access.gym.id, wall)
    rows, following = page_of(session, select(Scan).where(Scan.wall_id == wall), Scan, cursor, size)
    return Page(items=[facts_of(session, row) for row in rows], next=following)


@router.post("/gyms/{gym}/walls/{wall}/scans", status_code=201)
def begin_scan(wall: UUID, session: Db, access: UploaderMay) -> ScanFacts:
    """Begin a version of the wall, to which photos are sent. It will lie in the frame of the one
    that is published now."""
    row = wall_of(session, access.gym.id, wall)
    scan = begin(session, row, access.actor.known)
    _log(session, access, "scan.create", scan)
    return facts_of(session, scan)


@router.get("/gyms/{gym}/scans/{scan}")
def read_scan(scan: UUID, session: Db, access: UploaderMay) -> ScanFacts:
    """One version of a wall, and how far it is."""
    return facts_of(session, scan_of(session, access.gym.id, scan))


@dataclass(frozen=True)
class _Watched:
    """A scan of a gym, and how it was when somebody began to watch."""

    gym: UUID
    facts: ScanFacts


def _to_watch(scan: UUID, session: Db, access: UploaderMay) -> _Watched:
    """Looked up before the answer begins: after that none could say that it is not there."""
    facts = facts_of(session, scan_of(session, access.gym.id, scan))
    return _Watched(access.gym.id, facts)


def _facts_now(services: Services, watched: _Watched) -> ScanFacts:
    with services.database.reading() as session:
        return facts_of(session, scan_of(session, watched.gym, watched.facts.id))


@router.get("/gyms/{gym}/scans/{scan}/events", response_class=EventSourceResponse)
async def watch_scan(
    request: Request, services: ServicesOf, first: Annotated[_Watched, Depends(_to_watch)]
) -> AsyncIterator[ScanFacts]:
    """How far the scan is, whenever that changes; ends when nobody works on it any more.

    Asked of the table, so that it is the same whichever worker tells, and on whichever server.
    """
    facts = first.facts
    yield facts
    while facts.state in (State.QUEUED, State.RUNNING) and not await request.is_disconnected():
        await sleep(_WATCH_S)
        before, facts = facts, await to_thread.run_sync(_facts_now, services, first)
        if facts != before:
            yield facts


@router.post("/gyms/{gym}/scans/{scan}/start")
def start_scan(scan: UUID, session: Db, access: UploaderMay) -> ScanFacts:
    """Make a wall of the photos; again, where that failed or was cancelled."""
    row = scan_of(session, access.gym.id, scan)
    start(session, row)
    _log(session, access, "scan.start", row)
    return facts_of(session, row)


@router.post("/gyms/{gym}/scans/{scan}/cancel")
def cancel_scan(scan: UUID, session: Db, access: UploaderMay) -> ScanFacts:
    """Stop working on it; what is done is kept, should it be started again."""
    row = scan_of(session, access.gym.id, scan)
    move(session, row.id, State.CANCELLED)
    session.refresh(row)
    _log(session, access, "scan.cancel", row)
    return facts_of(session, row)


def _log(session: Session, access: Access, action: str, scan: Scan) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id,
               subject=str(scan.id))  # fmt: skip

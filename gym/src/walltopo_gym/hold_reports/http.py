"""Endpoints of hold reports: climbers report, setters check."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.fields import Body, Note
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.gyms.access import Access, SetterMay, gym_rule
from walltopo_gym.gyms.members import check_not_banned
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.hold_reports.service import (
    Fault,
    Kind,
    OpenReport,
    mark_done,
    report_of,
    reports_of,
    store_report,
)
from walltopo_gym.publishing.version_holds import check_version, version_holds
from walltopo_gym.walls.lookup import wall_of

router = APIRouter(tags=["hold reports"])

ClimberMay = Annotated[Access, gym_rule(Role.GUEST, None)]
CheckerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]


class NewHoldReport(Body):
    """A report of a hold by its id in the version `scan_id`, or of a route without a hold."""

    wall_id: UUID
    scan_id: UUID
    hold: int | None = Field(None, ge=1, le=65535)
    route_id: UUID | None = None
    kind: Kind
    note: Note = ""


class OwnHoldReport(BaseModel):
    """One's own report as it is stored; `done_at` is null while it is open."""

    id: UUID
    wall_id: UUID
    scan_id: UUID
    hold: int | None
    route_id: UUID | None
    kind: Kind
    note: str
    created_at: datetime
    done_at: datetime | None


class HoldReportOut(BaseModel):
    """One person's report of a hold. The reporter's name is not disclosed."""

    id: UUID
    kind: Kind
    note: str
    created_at: datetime


class HoldToCheck(BaseModel):
    """A reported hold with its reports, the earliest first.

    `hold` is its id in the version `scan_id`, null if only the route is known; `current_hold` its
    id in the published version. `earlier`: it was reported in an earlier scan, so that its place in
    the published one is not known. `people` counts the reporters.
    """

    wall_id: UUID
    wall_name: str
    scan_id: UUID
    hold: int | None
    current_hold: int | None
    earlier: bool
    route_id: UUID | None
    route_name: str
    grade: str
    colour: str
    people: int
    done_at: datetime | None
    reports: list[HoldReportOut]


@router.put("/gyms/{gym}/hold-reports/{report}")
def put_hold_report(
    report: UUID, body: NewHoldReport, response: Response, services: ServicesOf, access: ClimberMay
) -> OwnHoldReport:
    """Report a hold under an id that the phone made, so that it is stored once. A second open
    report of the same hold and kind by the same person is answered with the first."""
    me = access.actor.known
    fault = Fault(body.scan_id, body.hold, body.route_id, body.kind, body.note)
    with services.database.reading() as session:
        is_stored = session.get(HoldReport, report) is not None
        if not is_stored:
            check_version(session, wall_of(session, access.gym.id, body.wall_id), body.scan_id)
    holds = {} if is_stored else version_holds(services.store, body.scan_id).by_id
    with services.database.writing() as session:
        check_not_banned(session, access.gym.id, me)
        wall = wall_of(session, access.gym.id, body.wall_id)
        row, is_new = store_report(session, report, me, wall, fault, holds)
    response.status_code = 201 if is_new else 200
    return OwnHoldReport.model_validate(row, from_attributes=True)


@router.get("/gyms/{gym}/hold-reports")
def list_hold_reports(
    session: Db,
    access: CheckerMay,
    wall: Annotated[UUID | None, Query(description="only of this wall")] = None,
    done: Annotated[bool, Query(description="those done in the last 30 days")] = False,
) -> list[HoldToCheck]:
    """Return the holds to check, the first reported first. Holds of stripped routes are absent."""
    if wall is not None:
        wall_of(session, access.gym.id, wall)
    holds: dict[object, list[OpenReport]] = {}
    for one in reports_of(session, access.gym.id, wall, done=done):
        holds.setdefault((one.of, one.report.done_at), []).append(one)
    return [_hold_to_check(reports) for reports in holds.values()]


@router.put("/gyms/{gym}/hold-reports/{report}/done", status_code=204)
def close_hold_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Close all open reports of a report's hold; repeating it is fine."""
    row = report_of(session, access.gym.id, report)
    if row.done_at is None:
        mark_done(session, access.gym.id, row, done=True)
        _log_hold_report(session, access, "hold.done", row)


@router.delete("/gyms/{gym}/hold-reports/{report}/done", status_code=204)
def reopen_hold_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Open the reports again that were closed together; repeating it is fine."""
    row = report_of(session, access.gym.id, report)
    if row.done_at is not None:
        mark_done(session, access.gym.id, row, done=False)
        _log_hold_report(session, access, "hold.open", row)


@router.delete("/gyms/{gym}/hold-reports/{report}", status_code=204)
def drop_hold_report(report: UUID, session: Db, access: SetterMay) -> None:
    """Delete one report for good, as for an abusive note."""
    row = report_of(session, access.gym.id, report)
    session.delete(row)
    _log_hold_report(session, access, "hold.delete", row)


def _hold_to_check(reports: list[OpenReport]) -> HoldToCheck:
    first, last = reports[0], reports[-1]
    # Deleted accounts count as one person each: a person has one open report of a kind.
    people = {one.report.person_id or one.report.id for one in reports}
    route = first.route
    return HoldToCheck(
        wall_id=first.wall.id,
        wall_name=first.wall.name,
        scan_id=last.report.scan_id,
        hold=first.report.hold,
        current_hold=last.current_hold,
        earlier=not last.is_current,
        route_id=first.report.route_id,
        route_name="" if route is None else route.name,
        grade="" if route is None else route.grade,
        colour=first.report.colour,
        people=len(people),
        done_at=first.report.done_at,
        reports=[HoldReportOut.model_validate(one.report, from_attributes=True) for one in reports],
    )


def _log_hold_report(session: Session, access: Access, action: str, row: HoldReport) -> None:
    access.log_change(
        session,
        action,
        subject=str(row.id),
        wall=str(row.wall_id),
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

"""Publications for later: at a time, or with the rest of the zone."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel
from sqlalchemy import select

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Moment
from walltopo_gym.api.publishing import Publication, confirmed
from walltopo_gym.api.routes import PublisherMay
from walltopo_gym.api.scans import scan_of
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.gyms.models import Wall
from walltopo_gym.publishing.models import Plan
from walltopo_gym.publishing.plans import rows_of
from walltopo_gym.scans.models import Scan

router = APIRouter(tags=["publishing"])


class NewPlan(Publication):
    """What is confirmed now, and when it shall be so: `at`, or with the whole zone (null)."""

    at: Moment | None = None


class PlanFacts(BaseModel):
    """A publication that waits; `error` says why it could not be done."""

    scan_id: UUID
    wall_id: UUID
    at: datetime | None
    created_at: datetime
    error: str


@router.get("/gyms/{gym}/plans")
def list_plans(session: Db, access: PublisherMay) -> list[PlanFacts]:
    """What is to be published later."""
    rows = session.execute(
        select(Plan, Scan.wall_id)
        .join(Scan, Scan.id == Plan.scan_id)
        .join(Wall, Wall.id == Scan.wall_id)
        .where(Wall.gym_id == access.gym.id)
        .order_by(Plan.created_at)
    )
    return [_facts(plan, wall) for plan, wall in rows]


@router.put("/gyms/{gym}/scans/{scan}/plan")
def put_plan(
    scan: UUID, body: NewPlan, session: Db, services: ServicesOf, access: PublisherMay
) -> PlanFacts:
    """Publish a scan later, with these routes; what was planned for it before gives way."""
    row = scan_of(session, access.gym.id, scan)
    entries, found = confirmed(session, services.store, access, row, body)
    wall = session.get_one(Wall, row.wall_id)
    if wall.revision != body.revision:
        raise ConflictError("the wall was changed meanwhile", "Look at it again.")
    if body.at is None and not wall.zone:
        raise ConflictError("this wall is in no zone", "Give a time, or the wall a zone.")
    plan = session.merge(
        Plan(
            scan_id=scan, over_id=wall.published_scan_id, made_by=access.actor.known, at=body.at,
            entries=rows_of(entries), found={str(n): each.row for n, each in found.items()},
            error="",
        )
    )  # fmt: skip
    session.flush()
    log_change(session, "scan.plan", person=access.actor.known, gym=access.gym.id,
               subject=str(scan), at=None if body.at is None else body.at.isoformat())  # fmt: skip
    return _facts(plan, row.wall_id)


@router.delete("/gyms/{gym}/scans/{scan}/plan", status_code=204)
def drop_plan(scan: UUID, session: Db, access: PublisherMay) -> None:
    """Do not publish it later."""
    plan = session.get(Plan, scan_of(session, access.gym.id, scan).id)
    if plan is None:
        raise NotFoundError("nothing is planned for this scan")
    session.delete(plan)
    log_change(session, "scan.unplan", person=access.actor.known, gym=access.gym.id,
               subject=str(scan))  # fmt: skip


def _facts(plan: Plan, wall: UUID) -> PlanFacts:
    return PlanFacts(scan_id=plan.scan_id, wall_id=wall, at=plan.at, created_at=plan.created_at,
                     error=plan.error)  # fmt: skip

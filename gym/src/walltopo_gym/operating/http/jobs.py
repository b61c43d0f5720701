"""Endpoints of the jobs that may need an operator."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field

from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.api.fields import Body, LongText
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.operating.jobs import cancel_scan, list_jobs, retry_job, retry_scan
from walltopo_gym.scans.service import State

router = APIRouter(prefix="/operator", tags=["operator"])


class ScanJobOut(BaseModel):
    """A scan that runs, waits or failed; `gym` is the slug, `notes` what a running one has
    noted."""

    id: UUID
    state: State
    gym: str
    wall: str
    created_at: datetime
    error: str
    hint: str
    stage: str
    doing: str
    notes: list[str]
    heard_at: datetime | None


class SetAsideJobOut(BaseModel):
    """A job that failed in all tries; `gym` is the slug, empty if it is gone."""

    id: str
    kind: str
    items: str
    gym: str
    error: str
    at: datetime
    can_retry: bool


class JobsOut(BaseModel):
    """At most 200 of each; `more`: there are more."""

    scans: list[ScanJobOut]
    set_aside: list[SetAsideJobOut]
    more: bool


class JobIn(Body):
    """The id of a job that was set aside."""

    id: Annotated[str, Field(min_length=1, max_length=200, pattern=LongText)]


@router.get("/jobs")
def list_operator_jobs(services: ServicesOf, actor: OperatorMay) -> JobsOut:
    """Return running, waiting and failed scans, and the jobs that were set aside."""
    return JobsOut.model_validate(list_jobs(services.database), from_attributes=True)


@router.post("/jobs/retry", status_code=204)
def retry_operator_job(body: JobIn, services: ServicesOf, actor: OperatorMay) -> None:
    """Queue a job that was set aside."""
    retry_job(services.database, body.id, actor.known)


@router.post("/scans/{scan}/retry", status_code=204)
def retry_operator_scan(scan: UUID, session: Db, actor: OperatorMay) -> None:
    """Queue a scan again."""
    retry_scan(session, scan, actor.known)


@router.post("/scans/{scan}/cancel", status_code=204)
def cancel_operator_scan(scan: UUID, session: Db, actor: OperatorMay) -> None:
    """Cancel a scan that runs or waits."""
    cancel_scan(session, scan, actor.known)

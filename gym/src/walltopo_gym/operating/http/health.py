"""Endpoints of the operator's view of the installation: findings, workers, queued mails."""

from __future__ import annotations

from datetime import datetime

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.errors import without_folders
from walltopo_gym.jobs.heartbeat import is_alive, list_workers
from walltopo_gym.operating.doctor import Health, examine
from walltopo_gym.operating.mail_queue import mail_queue, send_waiting

router = APIRouter(prefix="/operator", tags=["operator"])


class FindingOut(BaseModel):
    """One check of the installation; `mend`: the command, or the line of `gym.toml`, that mends
    it."""

    what: str
    state: Health
    message: str
    mend: str


@router.get("/findings", dependencies=[turn_for("doctor")])
def list_findings(services: ServicesOf, actor: OperatorMay) -> list[FindingOut]:
    """Return the findings of `walltopo gym doctor`."""
    return [
        FindingOut(
            what=one.what, state=one.state, message=without_folders(one.message), mend=one.mend
        )
        for one in examine(services.settings)
    ]


class WorkerOut(BaseModel):
    """A worker; `alive`: it gave a sign of life within the last minute."""

    name: str
    version: str
    started_at: datetime
    seen_at: datetime
    alive: bool


@router.get("/workers")
def list_operator_workers(session: Db, actor: OperatorMay) -> list[WorkerOut]:
    """Return the workers of the last 30 days that did not end by themselves, at most 200."""
    return [
        WorkerOut(
            name=row.name,
            version=row.version,
            started_at=row.started_at,
            seen_at=row.seen_at,
            alive=is_alive(row),
        )
        for row in list_workers(session)
    ]


class MailQueueOut(BaseModel):
    """The queued mails; `failed` were given up in the last 30 days, `error` is the last one."""

    waiting: int
    failed: int
    error: str
    error_at: datetime | None


class SentOut(BaseModel):
    """The number of mails that are sent now."""

    count: int


@router.get("/mails")
def read_mail_queue(services: ServicesOf, actor: OperatorMay) -> MailQueueOut:
    """Return the state of the queued mails."""
    return MailQueueOut.model_validate(mail_queue(services.database), from_attributes=True)


@router.post("/mails/send")
def send_waiting_mails(services: ServicesOf, actor: OperatorMay) -> SentOut:
    """Send the mails that wait for their next try now."""
    return SentOut(count=send_waiting(services.database, actor.known))

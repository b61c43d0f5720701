"""Endpoints of the backups at the target, and of runs that make or try one."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated

from fastapi import APIRouter, Header
from fastapi import Path as InPath
from obstore.exceptions import BaseError
from pydantic import BaseModel, Field
from starlette.responses import StreamingResponse

from walltopo.core import WalltopoError
from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, LongText
from walltopo_gym.api.ranges import ranged_file
from walltopo_gym.api.services import ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.errors import without_folders
from walltopo_gym.operating.backup_runs import last_run, new_backup_name, open_run, queue_run
from walltopo_gym.operating.backup_target import (
    MAX_LISTED,
    NAME_PATTERN,
    StoredBackup,
    open_target,
)
from walltopo_gym.operating.restoration import Restoration, check_restorable, server_name
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.models import BackupRun

router = APIRouter(prefix="/operator/backups", tags=["operator"])

Name = Annotated[str, InPath(max_length=100, pattern=NAME_PATTERN)]


class BackupOut(BaseModel):
    """A backup at the target, as its last trial found it.

    `tried_at` is null for one that was not tried, whose numbers are 0. `compared_rows`: false if it
    lists no tables, as old ones. `differences`: the first ones, empty if it is equal.
    """

    name: str
    size: int
    made_at: datetime
    version: str
    tried_at: datetime | None
    rows: int
    files: int
    compared_rows: bool
    differences: list[str]


class BackupRunOut(BaseModel):
    """A run that makes, tries or restores a backup; `kind`: "make", "try" or "restore".

    `state`: "queued", "running", "waiting" for its next try, "done" or "failed". `step`: "writing",
    "storing" or "trying", with numbers of files.
    """

    kind: str
    name: str
    state: str
    step: str
    done: int
    total: int
    created_at: datetime
    ended_at: datetime | None
    error: str


class BackupsOut(BaseModel):
    """The newest backups, at most 100, `more`: there are more.

    `server`: the name to type before a restoration. `target` is empty if none is set; `error`: why
    it cannot be read. `hour` is UTC. `run`: the one that waits or is at work, `last`: the one that
    ended last.
    """

    server: str
    target: str
    hour: int
    kept: int
    error: str
    backups: list[BackupOut]
    more: bool
    run: BackupRunOut | None
    last: BackupRunOut | None


class RestorationIn(Body):
    """The server's name, typed for confirmation."""

    server: Annotated[str, Field(min_length=1, max_length=260, pattern=LongText)]


@router.get("", dependencies=[turn_for("backups")])
def list_backups(services: ServicesOf, actor: OperatorMay) -> BackupsOut:
    """Return the backups at the target, the newest first, and the state of the runs."""
    settings = services.settings
    with services.database.reading() as session:
        run, last = open_run(session), last_run(session)
    found, error = read_target(settings)
    return BackupsOut(
        server=server_name(settings),
        target=without_folders(settings.backup_to),
        hour=settings.backup_hour,
        kept=settings.backups_kept,
        error=error,
        backups=[backup_out(one) for one in found[:MAX_LISTED]],
        more=len(found) > MAX_LISTED,
        run=_run_out(run) if run else None,
        last=_run_out(last) if last else None,
    )


@router.post("", status_code=202)
def make_backup(services: ServicesOf, actor: OperatorMay) -> BackupRunOut:
    """Queue a backup to the target."""
    open_target(services.settings)
    name = new_backup_name(services.database)
    with services.database.writing() as session:
        return _run_out(queue_run(session, "make", name, by=actor.known))


@router.post("/{name}/try", status_code=202)
def try_stored_backup(name: Name, services: ServicesOf, actor: OperatorMay) -> BackupRunOut:
    """Queue another trial of a backup."""
    open_target(services.settings).find(name)
    with services.database.writing() as session:
        return _run_out(queue_run(session, "try", name, by=actor.known))


@router.post("/{name}/restore", status_code=202)
def restore_backup(
    name: Name, body: RestorationIn, services: ServicesOf, actor: OperatorMay
) -> None:
    """Stop the server, replace its data by a backup, and serve again; 503 meanwhile.

    The former data are put aside. A failure leaves them in place and is the last run.
    """
    check_restorable(services.settings, services.database, name, body.server)
    with services.database.writing() as session:
        log_change(session, "backup.begin-restore", person=actor.known, subject=name)
    services.get(Restoration).begin(name, actor.known)


@router.get("/{name}/file", response_class=StreamingResponse)
def download_backup(
    name: Name,
    services: ServicesOf,
    actor: OperatorMay,
    byte_range: Annotated[str | None, Header(alias="range", max_length=100)] = None,
) -> StreamingResponse:
    """Return a backup; `Range` is answered. The download is in the audit log."""
    target = open_target(services.settings)
    found = target.find(name)
    with services.database.writing() as session:
        log_change(session, "backup.download", person=actor.known, subject=name)
    answer = ranged_file(target.store, name, found.size, "application/x-tar", byte_range)
    answer.headers["content-disposition"] = f'attachment; filename="{name}"'
    answer.headers["cache-control"] = "private, no-store"
    return answer


def read_target(settings: GymSettings) -> tuple[list[StoredBackup], str]:
    """Return the newest backups at the target, or why it cannot be read."""
    if not settings.backup_to:
        return [], ""
    try:
        return open_target(settings).newest(MAX_LISTED + 1), ""
    except (WalltopoError, BaseError, OSError) as why:
        return [], without_folders(str(why).partition("\n")[0])


def backup_out(one: StoredBackup) -> BackupOut:
    """Return a backup as the API has it."""
    facts = one.facts
    return BackupOut(
        name=one.name,
        size=one.size,
        made_at=one.made_at,
        version=facts.version if facts else "",
        tried_at=facts.tried_at if facts else None,
        rows=facts.rows if facts else 0,
        files=facts.files if facts else 0,
        compared_rows=facts.has_tables if facts else False,
        differences=list(facts.differences) if facts else [],
    )


def _run_out(row: BackupRun) -> BackupRunOut:
    return BackupRunOut.model_validate(
        {name: getattr(row, name) for name in BackupRunOut.model_fields}
        | {"error": without_folders(row.error)}
    )

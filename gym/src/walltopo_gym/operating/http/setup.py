"""Endpoints of an empty server: a backup is uploaded or chosen, and restored."""

from __future__ import annotations

from typing import Annotated, Final

from anyio import to_thread
from fastapi import APIRouter, Header, HTTPException, Request
from pydantic import BaseModel, Field

from walltopo_gym.accounts.access import BrowserMay
from walltopo_gym.api.fields import Body, Digits, LongText
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.api.tus import write_body
from walltopo_gym.errors import ConflictError, NotFoundError, without_folders
from walltopo_gym.operating.backup_runs import last_run
from walltopo_gym.operating.backup_target import NAME_PATTERN, open_target
from walltopo_gym.operating.http.backups import BackupOut, backup_out, read_target
from walltopo_gym.operating.replacement import check_places
from walltopo_gym.operating.restoration import Restoration
from walltopo_gym.operating.setup import UPLOADED, Setup, drop_upload
from walltopo_gym.scans.incoming import Incoming

router = APIRouter(prefix="/setup", tags=["server"])

MAX_UPLOAD: Final = 10**13  # bytes
Code = Annotated[str, Field(min_length=1, max_length=100, pattern=LongText)]


class SetupIn(Body):
    """The code of the server's log."""

    code: Code


class SetupRestoreIn(SetupIn):
    """The code, and the name of a backup at the target; null: the uploaded one."""

    name: Annotated[str, Field(max_length=100, pattern=NAME_PATTERN)] | None


class SetupOut(BaseModel):
    """The newest backups at the target; `error`: why it cannot be read; `failed`: why the last
    restoration failed."""

    error: str
    failed: str
    backups: list[BackupOut]


@router.post("/backups", dependencies=[turn_for("backups")])
def list_setup_backups(body: SetupIn, services: ServicesOf, actor: BrowserMay) -> SetupOut:
    """Return the backups that an empty server can restore."""
    _check_code(services, body.code)
    found, error = read_target(services.settings)
    with services.database.reading() as session:
        last = last_run(session)
    failed = without_folders(last.error) if last is not None and last.kind == "restore" else ""
    return SetupOut(error=error, failed=failed, backups=[backup_out(one) for one in found])


@router.put("/backup", status_code=204)
async def upload_backup(
    request: Request,
    services: ServicesOf,
    actor: BrowserMay,
    content_length: Annotated[Digits, Header(ge=1, le=MAX_UPLOAD)],
    x_walltopo_setup: Annotated[str, Header(max_length=100)] = "",
) -> None:
    """Upload a backup to an empty server; a broken upload leaves nothing."""
    await to_thread.run_sync(_check_code, services, x_walltopo_setup)
    lock, path = services.get(Setup).uploading, services.settings.data / UPLOADED
    if not lock.acquire(blocking=False):
        raise ConflictError("upkeep-busy", "upkeep-wait")
    try:
        path.unlink(missing_ok=True)
        path.touch(mode=0o600)
        with path.open("wb") as stream:
            check_room = services.get(Incoming).check_room
            await write_body(request, check_room, stream, content_length)
        if path.stat().st_size != content_length:
            raise HTTPException(422, "the upload was cut off")
    except BaseException:
        path.unlink(missing_ok=True)
        raise
    finally:
        lock.release()


@router.post("/restore", status_code=202)
def restore_into_empty(body: SetupRestoreIn, services: ServicesOf, actor: BrowserMay) -> None:
    """Restore a backup into an empty server, and serve again; 503 meanwhile."""
    _check_code(services, body.code)
    check_places(services.settings)
    if body.name is not None:
        open_target(services.settings).find(body.name)
        drop_upload(services.settings)
    elif not (services.settings.data / UPLOADED).is_file():
        raise NotFoundError("not-there-backup", name="")
    services.get(Restoration).begin(body.name or UPLOADED, None)


def _check_code(services: Services, code: str) -> None:
    with services.database.reading() as session:
        services.get(Setup).check(session, code)

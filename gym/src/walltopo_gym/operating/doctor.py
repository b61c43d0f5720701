"""Check an installation; each finding says what to do."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass
from datetime import timedelta
from importlib.util import find_spec
from typing import Final, Literal
from uuid import uuid4

from obstore.exceptions import BaseError
from sqlalchemy import func, select
from sqlalchemy.exc import SQLAlchemyError

from walltopo.core import WalltopoError
from walltopo.pipeline.settings import load_settings
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.jobs.worker_slot import count_living_workers
from walltopo_gym.mail import SmtpMailer
from walltopo_gym.migrations.run import NEWER_HINT, Age, age_of
from walltopo_gym.operating.backup_runs import last_run
from walltopo_gym.operating.backup_target import open_target
from walltopo_gym.operating.restored import known_server_id
from walltopo_gym.scans.models import Scan
from walltopo_gym.scans.service import State
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import open_store

_MB: Final = 1_000_000
_LATE: Final = timedelta(hours=36)  # a daily backup that is older is missing


Health = Literal["well", "look", "bad"]

_AGES: Final[dict[Age, tuple[Health, str]]] = {
    "current": ("well", "{}, of this version"),
    "older": ("look", "of an older version; `walltopo gym migrate` brings it up"),
    "newer": ("bad", f"a newer version of walltopo-gym made it: {NEWER_HINT}"),
}


@dataclass(frozen=True)
class Finding:
    """One check; `state`: "well", "look" (works, but needs attention) or "bad".

    `mend`: the command, or the line of `gym.toml`, that mends it; empty if nothing has to be.
    """

    what: str
    state: Health
    message: str
    mend: str = ""


def examine(settings: GymSettings) -> Iterator[Finding]:
    """Run all checks. Nothing changes but a test file in the store."""
    yield _check_database(settings)
    yield _check_store(settings)
    yield _disk_space(settings)
    yield _check_address(settings)
    yield _check_mail(settings)
    yield _scan_settings(settings)
    if settings.own_networks:
        yield _check_training()
    if not settings.database and not (settings.data / "gym.sqlite").is_file():
        return
    yield _check_workers(settings)
    yield _check_backups(settings)


def _run_check(what: str, mend: str, try_it: Callable[[], tuple[Health, str]]) -> Finding:
    """Return what a check says, or that it failed and why.

    Parameters
    ----------
    mend : what mends it, unless all is well.
    """
    try:
        state, message = try_it()
    except (SQLAlchemyError, BaseError, OSError, WalltopoError) as error:
        return Finding(what, "bad", str(error).splitlines()[0], mend)
    return Finding(what, state, message, "" if state == "well" else mend)


def _check_database(settings: GymSettings) -> Finding:
    if not settings.database and not (settings.data / "gym.sqlite").is_file():
        message = f"{settings.data}: no gym here yet; `serve` makes one"
        return Finding("database", "look", message, "walltopo gym serve --data DIR")

    def connect() -> tuple[Health, str]:
        with closing(Database(settings.database_url)) as database:
            state, message = _AGES[age_of(database)]
            return state, message.format("SQLite" if database.is_sqlite else "PostgreSQL")

    return _run_check("database", "walltopo gym migrate --data DIR", connect)


def _check_store(settings: GymSettings) -> Finding:
    def write() -> tuple[Health, str]:
        store = open_store(settings)
        key = f"doctor/{uuid4().hex}"
        store.put(key, b"walltopo")
        is_same = store.read(key) == b"walltopo"
        store.drop([key])
        if not is_same:
            raise OSError("what was written came back otherwise")
        return "well", settings.objects or "a folder"

    mend = 'objects = "s3://BUCKET/FOLDER"' if settings.objects else "chmod -R u+rwX DIR/files"
    return _run_check("files", mend, write)


def _disk_space(settings: GymSettings) -> Finding:
    def measure() -> tuple[Health, str]:
        free = shutil.disk_usage(settings.data).free / _MB
        state: Health = "well"
        if free < 5 * settings.keep_free_mb:
            state = "look" if free > settings.keep_free_mb else "bad"
        return state, (
            f"{free:,.0f} MB free, uploads are refused below {settings.keep_free_mb:,} MB"
        )

    return _run_check("room", "walltopo gym purge --data DIR", measure)


def _check_address(settings: GymSettings) -> Finding:
    if settings.is_secure:
        return Finding("address", "well", settings.link_base)
    message = f"{settings.link_base}: browsers keep no sign-in without https"
    return Finding("address", "bad", message, 'address = "https://walls.gym.example"')


def _check_mail(settings: GymSettings) -> Finding:
    if not settings.smtp_host:
        message = "mails are shown in the log alone; set `smtp_host`"
        return Finding("mail", "look", message, 'smtp_host = "mail.gym.example"')

    def sign_in() -> tuple[Health, str]:
        SmtpMailer(settings).check()
        return "well", f"by {settings.smtp_host}; `walltopo gym mail test ADDRESS` sends one"

    return _run_check("mail", "walltopo gym mail test ADDRESS --data DIR", sign_in)


def _scan_settings(settings: GymSettings) -> Finding:
    def read() -> tuple[Health, str]:
        load_settings(settings.scan_settings)
        return "well", str(settings.scan_settings or "the defaults")

    return _run_check("scans", 'scan_settings = "walltopo.toml"', read)


def _check_training() -> Finding:
    lacking = [name for name in ("walltopo_lab", "torch") if find_spec(name) is None]
    if lacking:
        message = f"{' and '.join(lacking)} is not here"
        mend = "pip install 'walltopo-lab[train]'  # where the worker runs"
        return Finding("own networks", "look", message, mend)
    return Finding("own networks", "well", "trained at night")


def _check_workers(settings: GymSettings) -> Finding:
    def count() -> tuple[Health, str]:
        with closing(Database(settings.database_url)) as database:
            alive = count_living_workers(settings, database)
            with database.reading() as session:
                queued = select(func.count()).select_from(Scan).where(Scan.state == State.QUEUED)
                waiting = session.scalar(queued) or 0
        state: Health = "look" if waiting and not alive else "well"
        return state, f"{alive} at work, {waiting} scans queued"

    return _run_check("workers", "walltopo gym worker --data DIR", count)


def _check_backups(settings: GymSettings) -> Finding:
    def look() -> tuple[Health, str]:
        if not settings.backup_to:
            return "look", "none are made; set `backup_to`"
        with closing(Database(settings.database_url)) as database, database.reading() as session:
            last, server = last_run(session), known_server_id(session)
        if last is not None and last.state == "failed":
            return "bad", f"the last one failed: {last.error}"
        newest = open_target(settings).newest_of(server)
        if newest is None:
            return "look", f"none yet; the first one is made at {settings.backup_hour:02}:07 UTC"
        result = "equal" if newest.is_equal else "not tried, or not equal"
        message = f"the last one of {newest.made_at:%Y-%m-%d %H:%M} UTC: {result}"
        is_late = newest.made_at < now() - _LATE
        return ("bad" if is_late or not newest.is_equal else "well"), message

    mend = (
        "walltopo gym backups make --data DIR"
        if settings.backup_to
        else 'backup_to = "/mnt/backups"'
    )
    return _run_check("backups", mend, look)

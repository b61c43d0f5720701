"""Delete expired rows, unreferenced files and old originals."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from datetime import timedelta
from functools import partial
from typing import Final
from uuid import UUID

from obstore.exceptions import BaseError
from sqlalchemy import String, cast, delete, exists, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import (
    ApiToken,
    Challenge,
    DeviceSignIn,
    KnownBrowser,
    MailedLink,
    OidcAttempt,
    SignIn,
    Try,
)
from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.events import RowsExpired, collect_answers
from walltopo_gym.gyms.models import Invitation
from walltopo_gym.operating.upkeep import lock_data_folder
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.own_network import is_network
from walltopo_gym.scans.service import State
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import FloorPlan

# A file is written before its row names it: younger ones may be waiting for theirs.
_YOUNG: Final = timedelta(days=1)
_EXPIRING: Final = (
    SignIn,
    ApiToken,
    Challenge,
    KnownBrowser,
    MailedLink,
    OidcAttempt,
    DeviceSignIn,
    Invitation,
)


@dataclass
class Purged:
    """The rows and files that a purge deleted or would delete.

    `failed`: files that could not be deleted, and why.
    """

    rows: int = 0
    files: list[str] = field(default_factory=list)
    bytes: int = 0
    failed: list[tuple[str, str]] = field(default_factory=list)

    def try_delete(self, name: str, delete_it: Callable[[], object]) -> bool:
        """Delete one file; note a failure and go on."""
        try:
            delete_it()
        except (OSError, BaseError) as error:
            self.failed.append((name, str(error).partition("\n")[0]))
            return False
        return True


def purge(
    settings: GymSettings, database: Database, store: FileStore, *, really: bool = True
) -> Purged:
    """Delete unreferenced files and expired rows.

    Files go first: on a full disk they make the room that the deletion of rows needs.

    Parameters
    ----------
    really : False: only list them.

    Raises
    ------
    ConflictError : as in `lock_data_folder`.
    """
    purged = Purged()
    with lock_data_folder(settings.data):
        for key, size, written in list(store.entries("")):
            if written > now() - _YOUNG or _is_named(settings, database, key):
                continue
            if really and not purged.try_delete(key, partial(store.drop, [key])):
                continue
            purged.files.append(key)
            purged.bytes += size
        if really:
            _drop_incoming(settings, database, purged)
        with database.writing() if really else database.reading() as session:
            purged.rows = sum(_delete_expired(session))
    return purged


def _delete_expired(session: Session) -> Iterator[int]:
    """Delete the expired rows of each table and return their number."""
    for kind in _EXPIRING:
        yield len(
            session.scalars(delete(kind).where(kind.expires_at < now()).returning(kind.id)).all()
        )
    yield from collect_answers(session, RowsExpired())
    old = delete(Try).where(Try.at < now() - timedelta(days=1)).returning(Try.id)
    yield len(session.scalars(old).all())


def _is_named(settings: GymSettings, database: Database, key: str) -> bool:
    """Return whether a row names this file. Checked for each file just before its deletion."""
    kind, _, rest = key.partition("/")
    ask = _NAMES.get(kind)
    if ask is None:
        return True  # not ours
    with database.reading() as session:
        return ask(session, rest, settings)


def _scan_is_there(session: Session, rest: str, settings: GymSettings) -> bool:
    try:
        scan = UUID(rest.partition("/")[0])
    except ValueError:
        return True
    return session.get(Scan, scan) is not None


def _is_shown(session: Session, rest: str, settings: GymSettings) -> bool:
    named = exists().where(cast(Scan.files, String).contains(f"content/{rest}"))
    return bool(session.scalar(select(named)))


def _is_wanted(session: Session, rest: str, settings: GymSettings) -> bool:
    """Return whether a scan may still need an original: until some time after its publication."""
    wanted = exists().where(Photo.sha256 == rest)
    if settings.keep_originals_days:
        late = now() - timedelta(days=settings.keep_originals_days)
        made = Scan.state.in_((State.PUBLISHED, State.SUPERSEDED)) & (Scan.published_at < late)
        wanted = wanted.where(Scan.id == Photo.scan_id, ~made)
    return bool(session.scalar(select(wanted)))


def _has_photo(session: Session, rest: str, settings: GymSettings) -> bool:
    named = exists().where(Photo.sha256 == rest.removesuffix(".jpg").partition("-")[0])
    return bool(session.scalar(select(named)))


def _is_a_plan(session: Session, rest: str, settings: GymSettings) -> bool:
    named = exists().where(FloorPlan.sha256 == rest.removesuffix(".png"))
    return bool(session.scalar(select(named)))


def _is_used(session: Session, rest: str, settings: GymSettings) -> bool:
    return is_network(session, f"networks/{rest}")


_NAMES: Final[dict[str, Callable[[Session, str, GymSettings], bool]]] = {
    "scans": _scan_is_there,
    "content": _is_shown,
    "originals": _is_wanted,
    "thumbnails": _has_photo,
    "plans": _is_a_plan,
    "networks": _is_used,
}


def _drop_incoming(settings: GymSettings, database: Database, purged: Purged) -> None:
    """Delete partly uploaded photos and work folders without a row."""
    with database.reading() as session:
        photos = {photo.hex for photo in session.scalars(select(Photo.id))}
        scans = {str(scan) for scan in session.scalars(select(Scan.id))}
    for path in sorted((settings.data / "incoming").glob("*")):
        if path.name not in photos:
            purged.try_delete(str(path), partial(path.unlink, missing_ok=True))
    for folder in (settings.data / "work").glob("*/*"):
        if folder.name not in scans:
            shutil.rmtree(folder, ignore_errors=True)

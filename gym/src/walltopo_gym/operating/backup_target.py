"""The place to which backups go: a folder, or a prefix of an S3 bucket.

Beside each backup lies a small file with the facts about it, so that an empty server can list what
is there.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from datetime import datetime
from pathlib import Path
from typing import Any, Final

import msgspec
from obstore.exceptions import BaseError
from obstore.store import LocalStore, ObjectStore, from_url

from walltopo.core import InputError, SettingsError
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.operating.backup_trial import trial_summary
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

FACTS: Final = ".json"  # after the name of the backup
WORK: Final = ".walltopo-partial-"  # and the server; in the folder, or in the data folder
MAX_LISTED: Final = 100
NAME_PATTERN: Final = r"^[A-Za-z0-9][A-Za-z0-9_.-]{0,95}\.tar$"
_TIME: Final = r"\d{8}T\d{6}Z"


class BackupFacts(msgspec.Struct, frozen=True):
    """Facts about a backup, as its last trial found them.

    Parameters
    ----------
    version : the one that made it; empty if it is unknown.
    rows, tables, files, differences, has_tables : as in `Trial`.
    """

    made_at: datetime
    version: str
    rows: int
    tables: int
    files: int
    has_tables: bool
    tried_at: datetime
    differences: tuple[str, ...]


@dataclass(frozen=True)
class StoredBackup:
    """A backup at the target; `facts` is None for one that was not tried."""

    name: str
    size: int
    stored_at: datetime
    facts: BackupFacts | None

    @property
    def made_at(self) -> datetime:
        """Return when it was made, or stored if that is unknown."""
        return self.stored_at if self.facts is None else self.facts.made_at

    @property
    def is_equal(self) -> bool:
        """Return whether its last trial found no difference."""
        return self.facts is not None and not self.facts.differences

    @property
    def summary(self) -> str:
        """Return the result of its last trial in one line."""
        if self.facts is None:
            return "not tried"
        one = self.facts
        return trial_summary(
            one.rows, one.tables, one.files, is_equal=self.is_equal, has_tables=one.has_tables
        )


@dataclass(frozen=True)
class BackupTarget:
    """The backups at one place, which several servers may share.

    Parameters
    ----------
    url : as in the settings; folder : None for S3.
    """

    url: str
    store: FileStore
    folder: Path | None

    def work_folder(self, settings: GymSettings, server: str) -> Path:
        """Return a server's folder of unfinished backups, on the disk of the folder of backups."""
        return (self.folder or settings.data) / f"{WORK}{server}"

    def newest(self, count: int = MAX_LISTED) -> list[StoredBackup]:
        """Return the newest backups, the newest first."""
        return [replace(one, facts=self._facts(one.name)) for one in self._listed()[:count]]

    def get(self, name: str) -> StoredBackup | None:
        """Return a backup by its name."""
        found = next((one for one in self._listed() if one.name == name), None)
        return None if found is None else replace(found, facts=self._facts(name))

    def find(self, name: str) -> StoredBackup:
        """Return a backup by its name.

        Raises
        ------
        NotFoundError : there is none.
        """
        found = self.get(name)
        if found is None:
            raise NotFoundError("not-there-backup", name=name)
        return found

    def receive(self, file: Path) -> None:
        """Store a finished backup under its name; until it is whole, nothing is there."""
        if self.folder is None:
            self.store.put(file.name, file)
        else:
            file.replace(self.folder / file.name)

    @contextmanager
    def local_copy(self, name: str, work: Path) -> Iterator[Path]:
        """Yield the path of a backup, which is fetched from S3 into `work` for the block."""
        if self.folder is not None:
            yield self.folder / name
            return
        path = work / name
        try:
            self.store.fetch(name, path)
            yield path
        finally:
            path.unlink(missing_ok=True)

    def save_facts(self, name: str, facts: BackupFacts) -> None:
        """Store the facts about a backup."""
        self.store.put(name + FACTS, msgspec.json.encode(facts))

    def newest_of(self, server: str) -> StoredBackup | None:
        """Return the newest backup that a server made."""
        made = self._made_by(server)
        return replace(made[0], facts=self._facts(made[0].name)) if made else None

    def drop_old(self, server: str, newest: str, kept: int) -> list[str]:
        """Delete a server's backups that are older than its `kept` equal ones up to the newest one.

        Nothing is deleted unless the newest one is equal. Later ones, of a clock that ran ahead,
        stay and do not count.

        Parameters
        ----------
        newest : the name of the backup that was made now.

        Returns
        -------
        names : of the deleted backups.
        """
        equal, dropped = 0, []
        made = [one for one in self._made_by(server) if one.name <= newest]
        for at, one in enumerate(made):
            if equal >= kept:
                self.store.drop([one.name, one.name + FACTS])
                dropped.append(one.name)
                continue
            is_equal = replace(one, facts=self._facts(one.name)).is_equal
            if at == 0 and not is_equal:
                return []
            equal += is_equal
        return dropped

    def _made_by(self, server: str) -> list[StoredBackup]:
        """Return the backups that a server made without their facts, the newest first."""
        own = re.compile(rf"walltopo-{re.escape(server)}-{_TIME}\.tar")
        made = [one for one in self._listed() if own.fullmatch(one.name)]
        return sorted(made, key=lambda one: one.name, reverse=True)  # the name has the time

    def _listed(self) -> list[StoredBackup]:
        """Return all backups without their facts, the newest first."""
        found = [
            StoredBackup(key, size, at, None)
            for key, size, at in self.store.top_entries()
            if re.fullmatch(NAME_PATTERN, key) and not self._is_link(key)
        ]
        return sorted(found, key=lambda one: (one.stored_at, one.name), reverse=True)

    def _is_link(self, name: str) -> bool:
        """Return whether a name leads to another file, which is not a backup at the target."""
        return self.folder is not None and (self.folder / name).is_symlink()

    def _facts(self, name: str) -> BackupFacts | None:
        try:
            return msgspec.json.decode(self.store.read(name + FACTS), type=BackupFacts)
        except (NotFoundError, msgspec.MsgspecError):
            return None


def open_target(settings: GymSettings) -> BackupTarget:
    """Return the target of the settings.

    Raises
    ------
    ConflictError : none is set. SettingsError : it is not a place for backups.
    InputError : the folder is missing.
    """
    url = settings.backup_to
    if not url:
        raise ConflictError("backup-no-target", "backup-set-target")
    if url.startswith("s3://"):
        _refuse_own_files(settings)
        return BackupTarget(url, FileStore(_open_bucket(settings)), None)
    folder = Path(url)
    if not folder.is_dir():
        raise InputError(f"{folder}: the folder of backups is not there", "Mount or create it.")
    if folder.resolve().is_relative_to(settings.data.resolve()):
        raise SettingsError(
            "backup_to is in the data folder", "Set a folder on another disk or machine."
        )
    return BackupTarget(url, FileStore(LocalStore(folder)), folder)


def _refuse_own_files(settings: GymSettings) -> None:
    """Refuse a prefix that contains the gym's own files, or is among them.

    Raises
    ------
    SettingsError : it is one.
    """
    places = [f"{url.rstrip('/')}/" for url in (settings.backup_to, settings.objects) if url]
    if len(places) == 2 and (places[0].startswith(places[1]) or places[1].startswith(places[0])):
        raise SettingsError("backup_to is in the store of files", "Set another bucket or prefix.")


def _open_bucket(settings: GymSettings) -> ObjectStore:
    """Return the bucket; its own address and keys win over those of the environment."""
    own = {
        "endpoint": settings.backup_endpoint,
        "region": settings.backup_region,
        "access_key_id": settings.backup_access_key,
        "secret_access_key": settings.backup_secret_key,
    }
    config: Any = {name: value for name, value in own.items() if value}
    is_plain = settings.backup_endpoint.startswith("http://")
    options: Any = {"allow_http": True} if is_plain else None
    try:
        return from_url(settings.backup_to, config=config, client_options=options)
    except (BaseError, ValueError) as error:
        raise SettingsError(f"backup_to: {error}") from error


def backup_name(server: str, made_at: datetime) -> str:
    """Return the name of a backup that a server begins at this time."""
    return f"walltopo-{server}-{made_at:%Y%m%dT%H%M%SZ}.tar"

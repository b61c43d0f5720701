"""The use of the disk and of the file store, by gym and kind of file."""

from __future__ import annotations

import shutil
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database, take_turn
from walltopo_gym.gyms.models import Gym
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.scans.own_network import OwnNetwork
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore
from walltopo_gym.storage.models import StorageUse
from walltopo_gym.walls.models import FloorPlan, Wall

# Kinds of files by the first part of their key; the others are "other".
_KINDS: Final = {
    "originals": "originals",
    "thumbnails": "thumbnails",
    "scans": "scans",
    "content": "published",
    "pictures": "published",
    "plans": "plans",
    "networks": "networks",
}
_MAX: Final = 200  # gyms of one answer


@dataclass(frozen=True)
class DiskUse:
    """Bytes of the disk of the data folder."""

    free: int
    total: int


def disk_use(settings: GymSettings) -> DiskUse:
    """Return the use of the disk of the data folder."""
    found = shutil.disk_usage(settings.data)
    return DiskUse(found.free, found.total)


@dataclass
class _Count:
    files: int = 0
    bytes: int = 0


def measure_storage(database: Database, store: FileStore) -> None:
    """Measure all files of the store, and replace the last measurement."""
    with database.reading() as session:
        owners = _Owners.read(session)
    counts: defaultdict[tuple[UUID | None, str], _Count] = defaultdict(_Count)
    for key, size, _ in store.entries(""):
        for gym in owners.gyms_of(key) or (None,):
            count = counts[gym, _KINDS.get(key.partition("/")[0], "other")]
            count.files += 1
            count.bytes += size
    at = now()
    with database.writing() as session:
        take_turn(session, "storage use")
        session.execute(delete(StorageUse))
        there = set(session.scalars(select(Gym.id)))
        session.add_all(
            StorageUse(gym_id=gym, kind=kind, files=count.files, bytes=count.bytes, measured_at=at)
            for (gym, kind), count in counts.items()
            if gym is None or gym in there
        )


@dataclass
class _Owners:
    """The gyms that name a file, by the part of its key that names it."""

    gyms: dict[str, set[UUID]] = field(default_factory=lambda: defaultdict(set))

    @classmethod
    def read(cls, session: Session) -> _Owners:
        """Return the owners of all files that rows name."""
        owners = cls()
        scans = select(Scan.id, Wall.gym_id, Scan.files).join(Wall, Wall.id == Scan.wall_id)
        for scan, gym, files in session.execute(scans):
            owners.gyms[str(scan)].add(gym)
            for file in files.values():
                owners.gyms[file["key"].partition("/")[2]].add(gym)
        photos = select(Photo.sha256, Wall.gym_id).distinct().where(Photo.sha256.is_not(None))
        photos = photos.join(Scan, Scan.id == Photo.scan_id).join(Wall, Wall.id == Scan.wall_id)
        for sha256, gym in session.execute(photos):
            owners.gyms[str(sha256)].add(gym)
        for sha256, gym in session.execute(select(FloorPlan.sha256, FloorPlan.gym_id)):
            owners.gyms[sha256].add(gym)
        for gym in session.scalars(select(Gym.id)):  # features keep a gym's files below its id
            owners.gyms[str(gym)].add(gym)
        for key, gym in session.execute(select(OwnNetwork.key, OwnNetwork.gym_id)):
            owners.gyms[key.partition("/")[2]].add(gym)
        return owners

    def gyms_of(self, key: str) -> set[UUID]:
        """Return the gyms that use a file; empty if no row names it."""
        name = key.partition("/")[2].partition("/")[0]
        name = name.partition(".")[0].partition("-")[0] if _is_picture(key) else name
        return self.gyms.get(name, set())


def _is_picture(key: str) -> bool:
    """Return whether a key has a hash with an ending, as of a thumbnail or a floor plan."""
    return key.startswith(("thumbnails/", "plans/"))


@dataclass(frozen=True)
class GymUse:
    """The files of a kind that a gym uses; `slug` and `name` are empty for files of no gym."""

    slug: str
    name: str
    kind: str
    files: int
    bytes: int


@dataclass(frozen=True)
class Use:
    """The last measurement; `measured_at` is None before the first one, `more`: not all gyms."""

    measured_at: datetime | None
    rows: list[GymUse]
    more: bool


def storage_use(session: Session) -> Use:
    """Return the last measurement, the gyms with the most bytes first."""
    sums = (
        select(StorageUse.gym_id)
        .group_by(StorageUse.gym_id)
        .order_by(func.sum(StorageUse.bytes).desc())
        .limit(_MAX + 1)
    )
    gyms: Sequence[UUID | None] = session.scalars(sums).all()
    rows = select(StorageUse, Gym.slug, Gym.name).outerjoin(Gym, Gym.id == StorageUse.gym_id)
    by_gym: defaultdict[UUID | None, list[GymUse]] = defaultdict(list)
    at = None
    for row, slug, name in session.execute(rows.order_by(StorageUse.bytes.desc())):
        at = row.measured_at
        by_gym[row.gym_id].append(GymUse(slug or "", name or "", row.kind, row.files, row.bytes))
    shown = [one for gym in gyms[:_MAX] for one in by_gym[gym]]
    return Use(at, shown, more=len(gyms) > _MAX)

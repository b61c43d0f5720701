"""The storage quota of a gym."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from uuid import UUID

from sqlalchemy import func, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import TooLargeError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.scans.models import Photo, Scan
from walltopo_gym.storage.models import StorageUse
from walltopo_gym.walls.models import Wall

_MB = 1_000_000


def used_bytes(session: Session, gyms: Collection[UUID]) -> Mapping[UUID, int]:
    """Return the bytes that each gym uses: at the last measurement, and by photos since then."""
    measured = (
        select(
            StorageUse.gym_id,
            func.sum(StorageUse.bytes).label("bytes"),
            func.max(StorageUse.measured_at).label("at"),
        )
        .where(StorageUse.gym_id.in_(gyms))
        .group_by(StorageUse.gym_id)
        .subquery()
    )
    newer = (
        select(Wall.gym_id, func.sum(Photo.size))
        .join(Scan, Scan.wall_id == Wall.id)
        .join(Photo, Photo.scan_id == Scan.id)
        .outerjoin(measured, measured.c.gym_id == Wall.gym_id)
        .where(Wall.gym_id.in_(gyms))
        .where(or_(measured.c.at.is_(None), Photo.created_at > measured.c.at))
        .group_by(Wall.gym_id)
    )
    found = dict.fromkeys(gyms, 0)
    for gym, size in session.execute(select(measured.c.gym_id, measured.c.bytes)):
        found[gym] += int(size)
    for gym, size in session.execute(newer):
        found[gym] += int(size)
    return found


def check_quota(session: Session, gym: Gym) -> None:
    """Refuse a new photo, which is stored in this transaction, if it exceeds the gym's quota.

    Raises
    ------
    TooLargeError : says how much the gym may use.
    """
    if gym.storage_quota_mb is None:
        return
    take_turn(session, f"storage {gym.id}")
    if used_bytes(session, [gym.id])[gym.id] > gym.storage_quota_mb * _MB:
        raise TooLargeError("storage-full", "storage-full-ask", quota=gym.storage_quota_mb)

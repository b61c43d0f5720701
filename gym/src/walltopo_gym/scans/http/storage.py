"""Endpoint of a gym's use of storage."""

from __future__ import annotations

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.api.services import Db
from walltopo_gym.gyms.access import OwnerMay
from walltopo_gym.scans.quota import used_bytes

router = APIRouter(tags=["gyms"])


class GymStorageOut(BaseModel):
    """Bytes that a gym uses, and its quota in megabytes; null: no limit."""

    used: int
    quota_mb: int | None


@router.get("/gyms/{gym}/storage")
def read_gym_storage(session: Db, access: OwnerMay) -> GymStorageOut:
    """Return how much storage the gym uses, and how much it may use."""
    gym = access.gym
    used = used_bytes(session, [gym.id])[gym.id]
    return GymStorageOut(used=used, quota_mb=gym.storage_quota_mb)

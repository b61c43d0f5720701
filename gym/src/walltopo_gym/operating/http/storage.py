"""Endpoints of the use of disk and file store."""

from __future__ import annotations

from datetime import datetime

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.api.services import Services, ServicesOf
from walltopo_gym.api.turns import turn_for
from walltopo_gym.operating.storage_use import disk_use, measure_storage, storage_use

router = APIRouter(prefix="/operator", tags=["operator"])


class GymUseOut(BaseModel):
    """The files of a kind that a gym uses; `slug` is empty for files that no gym names."""

    slug: str
    name: str
    kind: str
    files: int
    bytes: int


class StorageOut(BaseModel):
    """Bytes of the disk, and the last measurement of the file store.

    `measured_at` is null before the first one; `rows` are of at most 200 gyms, `more`: there are
    more. A file of several gyms counts for each.
    """

    free: int
    total: int
    measured_at: datetime | None
    rows: list[GymUseOut]
    more: bool


@router.get("/storage")
def read_storage(services: ServicesOf, actor: OperatorMay) -> StorageOut:
    """Return the use of the disk, and the last measurement of the file store."""
    return _storage(services)


@router.post("/storage/measure", dependencies=[turn_for("storage")])
def measure_operator_storage(services: ServicesOf, actor: OperatorMay) -> StorageOut:
    """Measure the file store now."""
    measure_storage(services.database, services.store)
    return _storage(services)


def _storage(services: Services) -> StorageOut:
    with services.database.reading() as session:
        use = storage_use(session)
    disk = disk_use(services.settings)
    return StorageOut.model_validate({**vars(disk), **vars(use)}, from_attributes=True)

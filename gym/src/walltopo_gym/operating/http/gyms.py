"""Endpoints of the operator's view of gyms."""

from __future__ import annotations

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.api.fields import Body
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.operating.gyms import limit_gym
from walltopo_gym.scans.quota import used_bytes
from walltopo_gym.settings import Switch

router = APIRouter(prefix="/operator", tags=["operator"])


class OperatorGymOut(BaseModel):
    """A gym; `used` in bytes, `quota_mb` null: no limit, `features_barred`: turned off by an
    operator."""

    id: UUID
    slug: str
    name: str
    visibility: str
    members: int
    used: int
    quota_mb: int | None
    features_off: list[Switch]
    features_barred: list[Switch]


class GymLimits(Body):
    """The storage quota in megabytes, null for no limit, and the features to turn off."""

    quota_mb: Annotated[int, Field(ge=0, le=100_000_000)] | None
    features_barred: list[Switch] = Field(max_length=10)


@router.get("/gyms")
def list_operator_gyms(
    session: Db, actor: OperatorMay, cursor: Cursor = None, size: Size = 50
) -> Page[OperatorGymOut]:
    """Return all gyms, the newest first."""
    rows, following = page_of(session, select(Gym), Gym, cursor, size)
    return Page(items=_gyms_out(session, rows), next=following)


@router.put("/gyms/{gym_id}/limits")
def limit_operator_gym(
    gym_id: UUID, body: GymLimits, session: Db, actor: OperatorMay
) -> OperatorGymOut:
    """Set the storage quota of a gym, and the features that are off for it."""
    row = limit_gym(session, gym_id, body.quota_mb, body.features_barred, actor.known)
    return _gyms_out(session, [row])[0]


def _gyms_out(session: Session, rows: list[Gym]) -> list[OperatorGymOut]:
    ids = [row.id for row in rows]
    used = used_bytes(session, ids)
    counts = select(Membership.gym_id, func.count()).where(Membership.gym_id.in_(ids))
    members = {row[0]: row[1] for row in session.execute(counts.group_by(Membership.gym_id))}
    return [
        OperatorGymOut(
            id=row.id,
            slug=row.slug,
            name=row.name,
            visibility=row.visibility,
            members=members.get(row.id, 0),
            used=used[row.id],
            quota_mb=row.storage_quota_mb,
            features_off=row.features_off,
            features_barred=row.features_barred,
        )
        for row in rows
    ]

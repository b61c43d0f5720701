"""Old boulders: every version of a wall that was published, with its routes as they were."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel

from walltopo_gym.api.publishing import Version
from walltopo_gym.api.routes import RouteFacts
from walltopo_gym.api.rules import GuestMay
from walltopo_gym.api.scans import scan_of
from walltopo_gym.api.services import Db
from walltopo_gym.api.walls import wall_of
from walltopo_gym.errors import NotFoundError
from walltopo_gym.publishing.past import routes_as_they_were, versions_of
from walltopo_gym.scans.states import State

router = APIRouter(tags=["publishing"])


class PastVersion(BaseModel):
    """A version that was the wall once, or is; `published_at`: since when."""

    scan_id: UUID
    published_at: datetime
    present: bool


@router.get("/gyms/{gym}/walls/{wall}/past")
def list_past(
    wall: UUID, session: Db, access: GuestMay,
    route: Annotated[UUID | None, Query(description="only versions in which it hangs")] = None,
) -> list[PastVersion]:  # fmt: skip
    """The versions of a wall that everybody may see, the first one first."""
    row = wall_of(session, access.gym.id, wall)
    return [
        PastVersion(scan_id=scan.id, published_at=scan.published_at,
                    present=scan.state == State.PUBLISHED)
        for scan in versions_of(session, row.id, route)
        if scan.published_at is not None
    ]  # fmt: skip


@router.get("/gyms/{gym}/walls/{wall}/past/{scan}")
def read_past(wall: UUID, scan: UUID, session: Db, access: GuestMay) -> Version:
    """One of them: its files, and its routes as they were on its last day."""
    row = scan_of(session, access.gym.id, scan)
    found = wall_of(session, access.gym.id, wall)
    is_public = row.state in (State.PUBLISHED, State.SUPERSEDED)
    if row.wall_id != found.id or not is_public or row.published_at is None:
        raise NotFoundError("no such version of this wall")
    base = f"/api/v1/gyms/{access.gym.slug}/scans/{row.id}/files"
    routes = []
    for placement, route, said in routes_as_they_were(session, row.id):
        facts = RouteFacts.model_validate(route, from_attributes=True).model_copy(update=said)
        facts.number, facts.holds = placement.number, placement.holds
        routes.append(facts)
    return Version(
        scan_id=row.id, revision=found.revision, published_at=row.published_at,
        files={path: f"{base}/{path}" for path in sorted(row.files)}, routes=routes,
    )  # fmt: skip

"""Endpoints of holds that changed since the last scan: setters look after them."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final, Literal
from uuid import UUID

from fastapi import APIRouter, Query
from pydantic import BaseModel
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.services import Db
from walltopo_gym.clock import now
from walltopo_gym.gyms.access import Access, SetterMay, gym_rule
from walltopo_gym.gyms.roles import Role
from walltopo_gym.hold_changes.models import HoldChange
from walltopo_gym.hold_changes.service import ComparedWall, change_of, compared_walls
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import Wall

router = APIRouter(tags=["hold changes"])

CheckerMay = Annotated[Access, gym_rule(Role.SETTER, Scope.READ)]


class HoldChangeOut(BaseModel):
    """A hold that changed, though its route stayed, as photos show it.

    `hold` is its id in the wall's published version, null for one that is gone. `turn_deg`:
    counter-clockwise, seen from the climber; `moved_m`: metres along the wall; null unless it
    turned or moved.
    """

    id: UUID
    kind: Literal["turned", "moved", "gone", "new"]
    hold: int | None
    route_id: UUID | None
    route_name: str
    grade: str
    colour: str
    turn_deg: float | None
    moved_m: float | None
    done_at: datetime | None


class HoldComparisonOut(BaseModel):
    """A wall whose published version was compared with an earlier scan.

    `since` is when the earlier version was published; `compared` the number of holds that both
    show, null until the comparison is through; `error` says why it failed.
    """

    wall_id: UUID
    wall_name: str
    since: datetime
    compared: int | None
    error: str
    changes: list[HoldChangeOut]


@router.get("/gyms/{gym}/hold-changes")
def list_hold_changes(
    session: Db,
    access: CheckerMay,
    wall: Annotated[UUID | None, Query(description="only of this wall")] = None,
    done: Annotated[bool, Query(description="those done in the last 30 days")] = False,
) -> list[HoldComparisonOut]:
    """Return the holds on each wall that changed since the scan before, by wall name."""
    if wall is not None:
        wall_of(session, access.gym.id, wall)
    return [_comparison_out(one) for one in compared_walls(session, access.gym.id, wall, done=done)]


@router.put("/gyms/{gym}/hold-changes/{change}/done", status_code=204)
def close_hold_change(change: UUID, session: Db, access: SetterMay) -> None:
    """Mark a changed hold as looked after; repeating it is fine."""
    row, wall = change_of(session, access.gym.id, change)
    if row.done_at is None:
        row.done_at = now()
        _log_hold_change(session, access, "hold-change.done", row, wall)


@router.delete("/gyms/{gym}/hold-changes/{change}/done", status_code=204)
def reopen_hold_change(change: UUID, session: Db, access: SetterMay) -> None:
    """List a changed hold again; repeating it is fine."""
    row, wall = change_of(session, access.gym.id, change)
    if row.done_at is not None:
        row.done_at = None
        _log_hold_change(session, access, "hold-change.open", row, wall)


def _comparison_out(one: ComparedWall) -> HoldComparisonOut:
    return HoldComparisonOut(
        wall_id=one.wall.id,
        wall_name=one.wall.name,
        since=one.comparison.since,
        compared=one.comparison.compared,
        error=one.comparison.error,
        changes=[_change_out(change, route) for change, route in one.changes],
    )


def _change_out(change: HoldChange, route: Route | None) -> HoldChangeOut:
    facts = {
        name: getattr(change, name) for name in HoldChangeOut.model_fields if hasattr(change, name)
    }
    return HoldChangeOut(
        **facts,
        route_name="" if route is None else route.name,
        grade="" if route is None else route.grade,
    )


def _log_hold_change(
    session: Session, access: Access, action: str, row: HoldChange, wall: Wall
) -> None:
    access.log_change(
        session,
        action,
        subject=str(row.id),
        wall=str(wall.id),
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

"""Endpoints of walls and the floor plan."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import datetime
from typing import Annotated, Final
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import ClosedWalls, collect_answers
from walltopo_gym.gyms.access import Access, GuestMay, OwnerMay, SetterMay
from walltopo_gym.walls.lookup import wall_of, walls_of
from walltopo_gym.walls.models import FloorPlan, Wall
from walltopo_gym.walls.service import key_of, store_plan_picture
from walltopo_gym.walls.zones import queue_publications

router = APIRouter(tags=["walls"])


class NewWall(Body):
    """A wall; `place` orders the gym's walls from left to right, `zone` joins walls that are set
    together."""

    name: Name
    place: int = Field(0, ge=-10_000, le=10_000)
    zone: Text = Field("", max_length=80)


class WallChange(Body):
    """Changes of a wall; omitted fields stay."""

    name: Name | None = None
    place: int | None = Field(None, ge=-10_000, le=10_000)
    zone: Text | None = Field(None, max_length=80)


class WallOut(BaseModel):
    """A wall; `published_scan_id` is the public version. `closed_since`: when an inspection closed
    it to climbers, null while it is open."""

    id: UUID
    name: str
    place: int
    zone: str
    published_scan_id: UUID | None
    revision: int
    created_at: datetime
    closed_since: datetime | None


@router.get("/gyms/{gym}/walls")
def list_walls(session: Db, access: GuestMay) -> list[WallOut]:
    """Return the gym's walls from left to right."""
    closed = _closed_walls(session, access)
    return [_wall_out(row, closed) for row in walls_of(session, access.gym.id)]


@router.post("/gyms/{gym}/walls", status_code=201)
def make_wall(body: NewWall, session: Db, access: SetterMay) -> WallOut:
    """Add a wall."""
    _refuse_taken(session, access.gym.id, body.name)
    row = Wall(gym_id=access.gym.id, name=body.name, place=body.place, zone=body.zone)
    session.add(row)
    session.flush()
    _log_wall(session, access, "wall.create", row)
    return _wall_out(row, {})


@router.get("/gyms/{gym}/walls/{wall}")
def read_wall(wall: UUID, session: Db, access: GuestMay) -> WallOut:
    """Return a wall."""
    row = wall_of(session, access.gym.id, wall)
    return _wall_out(row, _closed_walls(session, access))


@router.patch("/gyms/{gym}/walls/{wall}")
def change_wall(wall: UUID, body: WallChange, session: Db, access: SetterMay) -> WallOut:
    """Rename or move a wall."""
    row = wall_of(session, access.gym.id, wall)
    if body.name is not None and body.name != row.name:
        _refuse_taken(session, access.gym.id, body.name)
        row.name = body.name
    if body.place is not None:
        row.place = body.place
    if body.zone is not None:
        row.zone = body.zone
        queue_publications(session, access.gym.id)
    _log_wall(session, access, "wall.change", row)
    return _wall_out(row, _closed_walls(session, access))


@router.delete("/gyms/{gym}/walls/{wall}", status_code=204)
def drop_wall(wall: UUID, session: Db, access: OwnerMay) -> None:
    """Delete a wall for good, with its scans and routes."""
    row = wall_of(session, access.gym.id, wall)
    session.delete(row)
    queue_publications(session, access.gym.id)
    _log_wall(session, access, "wall.delete", row)


def _closed_walls(session: Session, access: Access) -> dict[UUID, datetime]:
    """Return since when walls are closed, by wall."""
    return dict(collect_answers(session, ClosedWalls(access.gym.id)))


def _wall_out(row: Wall, closed: Mapping[UUID, datetime]) -> WallOut:
    fields = {name: getattr(row, name) for name in WallOut.model_fields if name != "closed_since"}
    return WallOut.model_validate(fields | {"closed_since": closed.get(row.id)})


def _refuse_taken(session: Session, gym: UUID, name: str) -> None:
    taken = select(Wall.id).where(Wall.gym_id == gym, Wall.name == name)
    if session.scalar(taken) is not None:
        raise ConflictError("wall-name-taken", name=name)


def _log_wall(session: Session, access: Access, action: str, row: Wall) -> None:
    access.log_change(
        session,
        action,
        subject=row.name,
        wall=str(row.id),
    )


Part = Annotated[float, Field(ge=0, le=1)]


class WallPlace(Body):
    """A wall's place on the plan: shares of its width and height from the upper left corner."""

    wall_id: UUID
    x: Part
    y: Part


class FloorPlanOut(BaseModel):
    """The plan; without a picture `picture` is null, and the walls lie on an empty square."""

    picture: str | None
    width: int
    height: int
    walls: list[WallPlace]


class WallPlaces(Body):
    """The places of all walls on the plan; other walls are removed from it."""

    walls: list[WallPlace] = Field(max_length=500)


class PlanPicture(Response):
    media_type = "image/png"


@router.get("/gyms/{gym}/floor-plan")
def read_floor_plan(session: Db, access: GuestMay) -> FloorPlanOut:
    """Return the gym's floor plan."""
    return _plan_out(session, access)


@router.put("/gyms/{gym}/floor-plan")
def put_floor_plan(body: WallPlaces, session: Db, access: OwnerMay) -> FloorPlanOut:
    """Place the gym's walls on the plan."""
    if len({place.wall_id for place in body.walls}) < len(body.walls):
        raise RequestError("wall-on-plan-twice")
    here = Wall.gym_id == access.gym.id
    session.execute(update(Wall).where(here).values(plan_x=None, plan_y=None))
    for place in body.walls:
        row = wall_of(session, access.gym.id, place.wall_id)
        row.plan_x, row.plan_y = place.x, place.y
    session.flush()
    _log_plan(session, access, "plan.walls")
    return _plan_out(session, access)


@router.put(
    "/gyms/{gym}/floor-plan/picture",
    openapi_extra={
        "requestBody": {
            "required": True,
            "content": {
                kind: {"schema": {"type": "string", "format": "binary"}}
                for kind in ("image/jpeg", "image/png", "image/webp")
            },
        }
    },
)
async def put_plan_picture(
    request: Request, services: ServicesOf, access: OwnerMay
) -> FloorPlanOut:
    """Set the plan's picture; walls keep their places on it."""
    content = await request.body()
    return await to_thread.run_sync(_store_plan, services, access, content)


def _store_plan(services: Services, access: Access, content: bytes) -> FloorPlanOut:
    plan = store_plan_picture(services.store, access.gym, content)
    with services.database.writing() as session:
        session.merge(plan)
        session.flush()
        _log_plan(session, access, "plan.picture")
        return _plan_out(session, access)


@router.get("/gyms/{gym}/floor-plan/picture", response_class=PlanPicture)
def read_plan_picture(session: Db, services: ServicesOf, access: GuestMay) -> PlanPicture:
    """Return the plan's picture."""
    row = session.get(FloorPlan, access.gym.id)
    if row is None:
        raise NotFoundError("floor-no-picture")
    caching = "private" if access.gym.visibility == "private" else "public"
    headers = {"cache-control": f"{caching}, max-age=86400"}
    return PlanPicture(services.store.read(key_of(row.sha256)), headers=headers)


@router.delete("/gyms/{gym}/floor-plan/picture", status_code=204)
def drop_plan_picture(session: Db, access: OwnerMay) -> None:
    """Delete the plan's picture; repeating it is fine."""
    row = session.get(FloorPlan, access.gym.id)
    if row is not None:
        session.delete(row)
        _log_plan(session, access, "plan.no-picture")


def _plan_out(session: Session, access: Access) -> FloorPlanOut:
    row = session.get(FloorPlan, access.gym.id)
    placed = select(Wall).where(
        Wall.gym_id == access.gym.id, Wall.plan_x.is_not(None), Wall.plan_y.is_not(None)
    )
    # Another picture has another address, so that it may be kept for a day.
    picture = (
        f"/api/v1/gyms/{access.gym.slug}/floor-plan/picture?v={row.sha256[:12]}" if row else None
    )
    return FloorPlanOut(
        picture=picture,
        width=row.width if row else 1,
        height=row.height if row else 1,
        walls=[
            WallPlace(wall_id=wall.id, x=wall.plan_x, y=wall.plan_y)
            for wall in session.scalars(placed.order_by(Wall.place, Wall.name))
            if wall.plan_x is not None and wall.plan_y is not None
        ],
    )


def _log_plan(session: Session, access: Access, action: str) -> None:
    access.log_change(session, action, subject=access.gym.slug)


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

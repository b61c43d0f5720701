"""The gym's floor plan."""

from __future__ import annotations

from typing import Annotated
from uuid import UUID

from anyio import to_thread
from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field
from sqlalchemy import select, update
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body
from walltopo_gym.api.rules import Access, GuestMay, OwnerMay
from walltopo_gym.api.services import Db, Services, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.floor_plans import keep_picture, key_of
from walltopo_gym.gyms.models import FloorPlan, Wall

router = APIRouter(tags=["walls"])

Part = Annotated[float, Field(ge=0, le=1)]


class WallPlace(Body):
    """Where a wall is: parts of the plan's width and height, from its upper left corner."""

    wall_id: UUID
    x: Part
    y: Part


class FloorPlanFacts(BaseModel):
    """The plan; without a picture `picture` is null, and the walls lie on an empty square."""

    picture: str | None
    width: int
    height: int
    walls: list[WallPlace]


class WallPlaces(Body):
    """All walls that are on the plan; others are off it by this."""

    walls: list[WallPlace] = Field(max_length=500)


class PlanPicture(Response):
    media_type = "image/png"


@router.get("/gyms/{gym}/floor-plan")
def read_floor_plan(session: Db, access: GuestMay) -> FloorPlanFacts:
    """Where the gym's walls are."""
    return _facts(session, access)


@router.put("/gyms/{gym}/floor-plan")
def put_floor_plan(body: WallPlaces, session: Db, access: OwnerMay) -> FloorPlanFacts:
    """Say where the gym's walls are."""
    if len({place.wall_id for place in body.walls}) < len(body.walls):
        raise InputError("a wall is on the plan twice")
    here = Wall.gym_id == access.gym.id
    session.execute(update(Wall).where(here).values(plan_x=None, plan_y=None))
    for place in body.walls:
        row = wall_of(session, access.gym.id, place.wall_id)
        row.plan_x, row.plan_y = place.x, place.y
    session.flush()
    _log(session, access, "plan.walls")
    return _facts(session, access)


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
) -> FloorPlanFacts:
    """Let a picture be the plan; walls keep their places on it."""
    content = await request.body()
    return await to_thread.run_sync(_kept, services, access, content)


def _kept(services: Services, access: Access, content: bytes) -> FloorPlanFacts:
    plan = keep_picture(services.store, access.gym, content)
    with services.database.writing() as session:
        session.merge(plan)
        session.flush()
        _log(session, access, "plan.picture")
        return _facts(session, access)


@router.get("/gyms/{gym}/floor-plan/picture", response_class=PlanPicture)
def read_plan_picture(session: Db, services: ServicesOf, access: GuestMay) -> PlanPicture:
    """The plan's picture."""
    row = session.get(FloorPlan, access.gym.id)
    if row is None:
        raise NotFoundError("the gym has no picture of its floor")
    caching = "private" if access.gym.visibility == "private" else "public"
    headers = {"cache-control": f"{caching}, max-age=86400"}
    return PlanPicture(services.store.read(key_of(row.sha256)), headers=headers)


@router.delete("/gyms/{gym}/floor-plan/picture", status_code=204)
def drop_plan_picture(session: Db, access: OwnerMay) -> None:
    """Do without a picture; again, too."""
    row = session.get(FloorPlan, access.gym.id)
    if row is not None:
        session.delete(row)
        _log(session, access, "plan.no-picture")


def _facts(session: Session, access: Access) -> FloorPlanFacts:
    row = session.get(FloorPlan, access.gym.id)
    placed = select(Wall).where(
        Wall.gym_id == access.gym.id, Wall.plan_x.is_not(None), Wall.plan_y.is_not(None)
    )
    # Another picture has another address, so that it may be kept for a day.
    picture = (
        f"/api/v1/gyms/{access.gym.slug}/floor-plan/picture?v={row.sha256[:12]}" if row else None
    )
    return FloorPlanFacts(
        picture=picture,
        width=row.width if row else 1,
        height=row.height if row else 1,
        walls=[
            WallPlace(wall_id=wall.id, x=wall.plan_x, y=wall.plan_y)
            for wall in session.scalars(placed.order_by(Wall.place, Wall.name))
            if wall.plan_x is not None and wall.plan_y is not None
        ],
    )


def _log(session: Session, access: Access, action: str) -> None:
    log_change(session, action, person=access.actor.known, gym=access.gym.id,
               subject=access.gym.slug)  # fmt: skip

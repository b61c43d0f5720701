"""What a gym says of itself for its insights: its wish of grades, its holds, its washings."""

from __future__ import annotations

from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import Field
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.fields import Body, Name, Text
from walltopo_gym.api.insights import HoldInsights, Insights, holds_told, told
from walltopo_gym.api.rules import Access, SetterMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.api.walls import wall_of
from walltopo_gym.errors import NotFoundError
from walltopo_gym.insights.models import Aims, Washing
from walltopo_gym.insights.wishes import aims_of, check_wish

router = APIRouter(tags=["insights"])

Kind = Literal["", "slab", "vertical", "slight", "steep", "roof"]
Count = Annotated[int, Field(ge=0, le=100_000)]


class WishCell(Body):
    """How many routes of a grade shall hang, on a kind of wall (empty: on any), or both."""

    system: UUID | None = None
    grade: Text = ""
    steepness: Kind = ""
    routes: Annotated[int, Field(ge=0, le=1000)]


class Wish(Body):
    """All of it; what was wished before is gone."""

    cells: Annotated[list[WishCell], Field(max_length=500)]


class StockRow(Body):
    """How many holds of a colour, and type (empty: of all types), the gym has."""

    colour: Name
    type: Text = ""
    total: Count


class StockBody(Body):
    """All of it; `wash_after`: tries on a route after which its holds are due for washing."""

    rows: Annotated[list[StockRow], Field(max_length=1000)]
    wash_after: Annotated[int, Field(ge=1, le=100_000)]


@router.put("/gyms/{gym}/insights/wish")
def put_wish(body: Wish, session: Db, access: SetterMay) -> Insights:
    """Say which grades the gym would like to have on its walls."""
    check_wish(session, access.gym.id, [(c.system, c.grade, c.steepness) for c in body.cells])
    aims = _aims(session, access)
    aims.wish = [cell.model_dump(mode="json") for cell in body.cells]
    _log(session, access, "insights.wish")
    return told(session, access.gym)


@router.put("/gyms/{gym}/insights/stock")
def put_stock(
    body: StockBody, session: Db, services: ServicesOf, access: SetterMay
) -> HoldInsights:
    """Say which holds the gym has, and when they are due for washing."""
    if len({(row.colour, row.type) for row in body.rows}) < len(body.rows):
        raise InputError("a colour and type is there twice")
    aims = _aims(session, access)
    aims.stock, aims.wash_after = [row.model_dump() for row in body.rows], body.wash_after
    _log(session, access, "insights.stock")
    return holds_told(session, services.store, access.gym)


@router.post("/gyms/{gym}/walls/{wall}/washings", status_code=201)
def wash_wall(wall: UUID, session: Db, services: ServicesOf, access: SetterMay) -> HoldInsights:
    """The holds of a wall were washed now."""
    session.add(Washing(wall_id=wall_of(session, access.gym.id, wall).id))
    _log(session, access, "wall.wash", str(wall))
    return holds_told(session, services.store, access.gym)


@router.delete("/gyms/{gym}/walls/{wall}/washings/{washing}")
def drop_washing(
    wall: UUID, washing: UUID, session: Db, services: ServicesOf, access: SetterMay
) -> HoldInsights:
    """They were not."""
    row = session.get(Washing, washing)
    if row is None or row.wall_id != wall_of(session, access.gym.id, wall).id:
        raise NotFoundError("no such washing")
    session.delete(row)
    _log(session, access, "wall.no-wash", str(wall))
    return holds_told(session, services.store, access.gym)


def _aims(session: Session, access: Access) -> Aims:
    aims = aims_of(session, access.gym.id)
    session.add(aims)
    return aims


def _log(session: Session, access: Access, action: str, subject: str = "") -> None:
    session.flush()
    log_change(session, action, person=access.actor.known, gym=access.gym.id,
               subject=subject or access.gym.slug)  # fmt: skip

"""Endpoints of the lines of ropes on a wall."""

from __future__ import annotations

from typing import Annotated, Literal, Self
from uuid import UUID

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field, model_validator
from sqlalchemy.orm import Session

from walltopo_gym.api.fields import Body, Text
from walltopo_gym.api.services import Db
from walltopo_gym.gyms.access import Access, GuestMay, SetterMay
from walltopo_gym.publishing.lines import line_of, lines_of, remove_line, store_line
from walltopo_gym.walls.lookup import wall_of
from walltopo_gym.walls.models import RopeLine

router = APIRouter(tags=["ropes"])

Belay = Literal["lead", "top-rope", "auto-belay"]
Coordinate = Annotated[float, Field(ge=-1_000, le=1_000)]
Point = tuple[Coordinate, Coordinate, Coordinate]


class RopeLineIn(Body):
    """A line: its label, how it is climbed (the usual way first), and its clips from the lowest up
    with the anchor, in metres in the frame of the wall's scans."""

    label: Annotated[Text, Field(min_length=1, max_length=20)]
    belays: list[Belay] = Field(min_length=1, max_length=3)
    points: list[Point] = Field([], max_length=60)

    @model_validator(mode="after")
    def _have_each_once(self) -> Self:
        self.belays = list(dict.fromkeys(self.belays))
        return self


class RopeLineOut(BaseModel):
    """A line of a rope."""

    id: UUID
    label: str
    belays: list[Belay]
    points: list[Point]


@router.get("/gyms/{gym}/walls/{wall}/lines")
def list_lines(wall: UUID, session: Db, access: GuestMay) -> list[RopeLineOut]:
    """Return the lines of a wall; none if it is a boulder wall."""
    rows = lines_of(session, wall_of(session, access.gym.id, wall).id)
    return [_line_out(row) for row in rows]


@router.put("/gyms/{gym}/walls/{wall}/lines/{line}")
def put_line(
    wall: UUID, line: UUID, body: RopeLineIn, response: Response, session: Db, access: SetterMay
) -> RopeLineOut:
    """Add or change a line; `line` is the sender's choice."""
    row, is_new = store_line(
        session, wall_of(session, access.gym.id, wall), line, body.model_dump(mode="json")
    )
    response.status_code = 201 if is_new else 200
    _log_line(session, access, "line.create" if is_new else "line.change", row)
    return _line_out(row)


@router.delete("/gyms/{gym}/walls/{wall}/lines/{line}", status_code=204)
def drop_line(wall: UUID, line: UUID, session: Db, access: SetterMay) -> None:
    """Remove a line without current routes; climbs on it stay."""
    row = wall_of(session, access.gym.id, wall)
    gone = line_of(session, row.id, line)
    remove_line(session, row, gone)
    _log_line(session, access, "line.delete", gone)


def _line_out(row: RopeLine) -> RopeLineOut:
    return RopeLineOut.model_validate(row, from_attributes=True)


def _log_line(session: Session, access: Access, action: str, row: RopeLine) -> None:
    access.log_change(
        session,
        action,
        subject=row.label,
        wall=str(row.wall_id),
    )

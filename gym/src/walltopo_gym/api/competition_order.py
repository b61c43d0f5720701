"""Who climbs in a round of a competition, and in which order."""

from __future__ import annotations

from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.api.competitions import competition_of
from walltopo_gym.api.fields import Body
from walltopo_gym.api.rules import Access, GuestMay, SetterMay
from walltopo_gym.api.services import Db
from walltopo_gym.competitions.making import locked
from walltopo_gym.competitions.models import Competition, Round
from walltopo_gym.competitions.order import draw, put_order, starters
from walltopo_gym.competitions.running import round_of

router = APIRouter(tags=["competitions"])


class StarterFacts(BaseModel):
    """Somebody's place in the running order of their category, from 1."""

    category_id: UUID
    place: int
    entry_id: UUID
    bib: int
    name: str


class OrderBody(Body):
    """Who of a category is in the round, the first to climb first."""

    category_id: UUID
    entry_ids: list[UUID] = Field(max_length=2_000)


@router.get("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters")
def list_starters(
    competition: UUID, one: UUID, session: Db, access: GuestMay
) -> list[StarterFacts]:
    """Who climbs in a round, category by category and in running order."""
    row = competition_of(session, access, competition)
    return _order(session, row, round_of(session, row, one))


@router.put("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters")
def put_starters(
    competition: UUID, one: UUID, body: OrderBody, session: Db, access: SetterMay
) -> list[StarterFacts]:
    """Let a category climb in another order; in a round with a quota also let others be in it. Who
    is not named, and is in it anyway, comes last."""
    row = locked(session, access.gym.id, competition)
    found = round_of(session, row, one)
    put_order(session, row, found, body.category_id, body.entry_ids)
    _log(session, access, row)
    return _order(session, row, found)


@router.post("/gyms/{gym}/competitions/{competition}/rounds/{one}/starters/draw")
def draw_starters(
    competition: UUID, one: UUID, session: Db, access: SetterMay
) -> list[StarterFacts]:
    """Draw a running order anew while nobody has scored in the round: by lot, or, with a quota,
    from the ranks of the round before, whose best comes last."""
    row = locked(session, access.gym.id, competition)
    found = round_of(session, row, one)
    draw(session, row, found)
    _log(session, access, row)
    return _order(session, row, found)


def _order(session: Session, row: Competition, one: Round) -> list[StarterFacts]:
    return [
        StarterFacts(category_id=entry.category_id, place=place, entry_id=entry.id, bib=entry.bib,
                     name=entry.name)
        for entry, place in starters(session, row, one)
    ]  # fmt: skip


def _log(session: Session, access: Access, row: Competition) -> None:
    log_change(session, "round.order", person=access.actor.known, gym=access.gym.id,
               subject=row.name, competition=str(row.id))  # fmt: skip

"""One's own ascents and opinions in a gym, for what is left to do there."""

from __future__ import annotations

from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.climbing import OpinionWords, OwnAscent
from walltopo_gym.api.rules import Access, gym_rule
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.logbook import logbook
from walltopo_gym.gyms.roles import Role

router = APIRouter(tags=["climbing"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class OwnOpinion(OpinionWords):
    """What one thinks of a route."""

    route_id: UUID


class LogbookFacts(BaseModel):
    """Of the routes that hang: one's ascents, the last climbed first, and one's opinions."""

    ascents: list[OwnAscent]
    opinions: list[OwnOpinion]


@router.get("/gyms/{gym}/logbook")
def read_logbook(session: Db, access: ReaderMay) -> LogbookFacts:
    """What one did here and thinks of it; of routes that hang no more see `/me/ascents`."""
    kept = logbook(session, access.gym.id, access.actor.known)
    return LogbookFacts(
        ascents=[OwnAscent.model_validate(row, from_attributes=True) for row in kept.ascents],
        opinions=[_words(row) for row in kept.opinions],
    )


def _words(row: object) -> OwnOpinion:
    return OwnOpinion.model_validate(row, from_attributes=True)

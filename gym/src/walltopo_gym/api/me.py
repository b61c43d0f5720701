"""One's own account."""

from __future__ import annotations

from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.rules import SignedInMay
from walltopo_gym.api.services import Db

router = APIRouter(tags=["accounts"])


class Me(BaseModel):
    """One's own account."""

    id: UUID
    email: str
    name: str
    operator: bool


class Renaming(Body):
    name: Name


@router.get("/me")
def read_me(session: Db, actor: SignedInMay) -> Me:
    """One's own account."""
    return me_of(session.get_one(Person, actor.known))


@router.patch("/me")
def rename_me(body: Renaming, session: Db, actor: SignedInMay) -> Me:
    """Change one's name."""
    person = session.get_one(Person, actor.known)
    person.name = body.name
    log_change(session, "person.rename", person=person.id)
    return me_of(person)


def me_of(person: Person) -> Me:
    """An account as its owner is told."""
    return Me(id=person.id, email=person.email, name=person.name, operator=person.operator)

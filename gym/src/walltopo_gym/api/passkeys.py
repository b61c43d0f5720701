"""Passkeys: added to an account, and signing in with one."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel
from sqlalchemy import delete, select

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import Passkey, Person
from walltopo_gym.accounts.passkeys import (
    Site,
    add_passkey,
    ask_for_new,
    ask_for_sign_in,
    person_of,
)
from walltopo_gym.api.cookies import begin_here
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.me import Me, me_of
from walltopo_gym.api.rules import AnyoneMay, SignedInMay
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.errors import NotFoundError

router = APIRouter(tags=["accounts"])


class NewPasskey(Body):
    """What `navigator.credentials.create` gave, as JSON; `name` is for its owner."""

    name: Name
    credential: dict[str, Any]


class SignedChallenge(Body):
    """What `navigator.credentials.get` gave, as JSON."""

    credential: dict[str, Any]


class PasskeyFacts(BaseModel):
    """A passkey of one's own."""

    id: UUID
    name: str
    created_at: datetime
    used_at: datetime | None


@router.post("/me/passkeys/options")
def begin_passkey(session: Db, services: ServicesOf, actor: SignedInMay) -> dict[str, Any]:
    """What a browser asks the device to make: `PublicKeyCredentialCreationOptions` as JSON."""
    person = session.get_one(Person, actor.known)
    return ask_for_new(session, Site(services.settings.link_base), person)


@router.post("/me/passkeys", status_code=201)
def make_passkey(
    body: NewPasskey, session: Db, services: ServicesOf, actor: SignedInMay
) -> PasskeyFacts:
    """Add a passkey."""
    site = Site(services.settings.link_base)
    row = add_passkey(session, site, actor.known, body.name, body.credential)
    return PasskeyFacts.model_validate(row, from_attributes=True)


@router.get("/me/passkeys")
def list_passkeys(session: Db, actor: SignedInMay) -> list[PasskeyFacts]:
    """One's passkeys."""
    mine = select(Passkey).where(Passkey.person_id == actor.known).order_by(Passkey.created_at)
    return [PasskeyFacts.model_validate(row, from_attributes=True)
            for row in session.scalars(mine)]  # fmt: skip


@router.delete("/me/passkeys/{passkey}", status_code=204)
def drop_passkey(passkey: UUID, session: Db, actor: SignedInMay) -> None:
    """Let a passkey sign in no more."""
    gone = delete(Passkey).where(Passkey.id == passkey, Passkey.person_id == actor.known)
    if session.execute(gone.returning(Passkey.id)).one_or_none() is None:
        raise NotFoundError("no such passkey")
    log_change(session, "passkey.delete", person=actor.known, subject=str(passkey))


@router.post("/session/passkey/options")
def begin_passkey_session(session: Db, services: ServicesOf, actor: AnyoneMay) -> dict[str, Any]:
    """What a browser asks the device to sign: `PublicKeyCredentialRequestOptions` as JSON."""
    return ask_for_sign_in(session, Site(services.settings.link_base))


@router.post("/session/passkey")
def begin_session_by_passkey(
    body: SignedChallenge, request: Request, response: Response, services: ServicesOf,
    actor: AnyoneMay,
) -> Me:  # fmt: skip
    """Sign in with a passkey."""
    with services.database.writing() as session:
        person = person_of(session, Site(services.settings.link_base), body.credential)
        begin_here(session, services, request, response, person)
        return me_of(session.get_one(Person, person))

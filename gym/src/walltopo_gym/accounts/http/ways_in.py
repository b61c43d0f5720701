"""Endpoints of passkeys, and of proving again who one is before a way to sign in changes."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import Update, delete, select, update

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.access import ConfirmedMay, SignedInMay
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.http.account import Code, OwnPassword
from walltopo_gym.accounts.http.sign_in import SignedChallenge
from walltopo_gym.accounts.limits import count_code
from walltopo_gym.accounts.models import Passkey, Person, SignIn
from walltopo_gym.accounts.notices import NotifyOwner
from walltopo_gym.accounts.passkeys import Site, add_passkey, ask_for_new, person_of
from walltopo_gym.accounts.passwords import check_own_password
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError, RequestError

router = APIRouter(tags=["accounts"])


class OwnProof(OwnPassword):
    """The password, and the second factor if it is on."""

    code: Code | None = Field(None, description="of the second factor, where it is on")


@router.post("/me/confirm", status_code=204)
def confirm_by_password(body: OwnProof, services: ServicesOf, actor: SignedInMay) -> None:
    """Prove by the password, and by the second factor if it is on, who one is.

    For ten minutes this browser may change ways to sign in, for fifteen an operator's may
    administer the server.
    """
    check_own_password(services, actor.known, body.password)
    if body.code is not None:
        with services.database.writing() as session:
            count_code(session, actor.known)
    with services.database.writing() as session:
        second_factor.check(session, actor.known, body.code)
        session.execute(_confirm_sign_in(actor.sign_in))


@router.post("/me/confirm/passkey", status_code=204)
def confirm_by_passkey(
    body: SignedChallenge, session: Db, services: ServicesOf, actor: SignedInMay
) -> None:
    """Prove it by a passkey, which signs the challenge of `/session/passkey/options`."""
    if person_of(session, Site(services.settings.link_base), body.credential) != actor.known:
        raise RequestError("passkey-wrong")
    session.execute(_confirm_sign_in(actor.sign_in))


def _confirm_sign_in(sign_in: UUID | None) -> Update:
    return update(SignIn).where(SignIn.id == sign_in).values(confirmed_at=now())


class NewPasskey(Body):
    """The result of `navigator.credentials.create` as JSON; `name` is chosen by the owner."""

    name: Name
    credential: dict[str, Any]


class PasskeyOut(BaseModel):
    """One of the person's passkeys."""

    id: UUID
    name: str
    created_at: datetime
    used_at: datetime | None


@router.post("/me/passkeys/options")
def begin_passkey(session: Db, services: ServicesOf, actor: ConfirmedMay) -> dict[str, Any]:
    """Return `PublicKeyCredentialCreationOptions` as JSON."""
    person = session.get_one(Person, actor.known)
    return ask_for_new(session, Site(services.settings.link_base), person)


@router.post("/me/passkeys", status_code=201)
def make_passkey(
    body: NewPasskey, session: Db, notify: NotifyOwner, services: ServicesOf, actor: ConfirmedMay
) -> PasskeyOut:
    """Add a passkey. The owner gets a mail."""
    site = Site(services.settings.link_base)
    row = add_passkey(session, site, actor.known, body.name, body.credential)
    notify(session, actor.known, "passkey-added", row.name)
    return PasskeyOut.model_validate(row, from_attributes=True)


@router.get("/me/passkeys")
def list_passkeys(session: Db, actor: SignedInMay) -> list[PasskeyOut]:
    """Return one's passkeys."""
    mine = select(Passkey).where(Passkey.person_id == actor.known).order_by(Passkey.created_at)
    return [PasskeyOut.model_validate(row, from_attributes=True) for row in session.scalars(mine)]


@router.delete("/me/passkeys/{passkey}", status_code=204)
def drop_passkey(passkey: UUID, session: Db, notify: NotifyOwner, actor: ConfirmedMay) -> None:
    """Delete a passkey. The owner gets a mail."""
    gone = delete(Passkey).where(Passkey.id == passkey, Passkey.person_id == actor.known)
    name = session.scalar(gone.returning(Passkey.name))
    if name is None:
        raise NotFoundError("not-there-passkey")
    notify(session, actor.known, "passkey-removed", name)
    log_change(session, "passkey.delete", person=actor.known, subject=str(passkey))

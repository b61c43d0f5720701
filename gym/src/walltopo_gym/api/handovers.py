"""Signing in on a second device by a QR code; how, and against whom: accounts/handovers.py."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, Field

from walltopo_gym.accounts.handovers import allow, claim, finish, handover_of, offer
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.cookies import begin_here
from walltopo_gym.api.fields import Body, Secret
from walltopo_gym.api.me import Me, me_of
from walltopo_gym.api.rules import AnyoneMay, SignedInMay
from walltopo_gym.api.services import Db, ServicesOf

router = APIRouter(tags=["accounts"])


class MadeHandover(BaseModel):
    """An offer: `link` is what the QR code shows, told this once."""

    id: UUID
    link: str
    expires_at: datetime


class HandoverFacts(BaseModel):
    """How far an offer is; `code` and `browser` of who took it up, empty until somebody has."""

    browser: str
    code: str
    allowed: bool


class Permission(Body):
    """The code that the other device shows."""

    code: Annotated[str, Field(pattern=r"^[0-9]{6}$")]


class SecretOnly(Body):
    secret: Secret


class MadeClaim(BaseModel):
    """What signs in once the other device has said yes, and the code by which it knows this one."""

    claim: str
    code: str


class SignedIn(BaseModel):
    """Who is signed in now; null while the other device has not said yes."""

    me: Me | None


@router.post("/me/handovers", status_code=201)
def make_handover(session: Db, services: ServicesOf, actor: SignedInMay) -> MadeHandover:
    """Offer to sign in on another device; what was offered before is good no more."""
    assert actor.sign_in is not None  # SignedInMay lets no token in
    row, secret = offer(session, actor.known, actor.sign_in)
    link = f"{services.settings.link_base}/sign-in/device#{secret}"
    return MadeHandover(id=row.id, link=link, expires_at=row.expires_at)


@router.get("/me/handovers/{handover}")
def read_handover(handover: UUID, session: Db, actor: SignedInMay) -> HandoverFacts:
    """Whether somebody has taken the offer up, and with which code."""
    row = handover_of(session, handover, actor.sign_in)
    return HandoverFacts.model_validate(row, from_attributes=True)


@router.post("/me/handovers/{handover}/allow", status_code=204)
def allow_handover(handover: UUID, body: Permission, session: Db, actor: SignedInMay) -> None:
    """Let in who shows this code."""
    allow(session, handover, actor.sign_in, body.code)


@router.post("/session/handover/claim", status_code=201)
def claim_handover(body: SecretOnly, request: Request, session: Db, actor: AnyoneMay) -> MadeClaim:
    """Take up what a QR code offers."""
    claimed, code = claim(session, body.secret, request.headers.get("user-agent", ""))
    return MadeClaim(claim=claimed, code=code)


@router.post("/session/handover")
def begin_session_by_handover(
    body: SecretOnly, request: Request, response: Response, session: Db, services: ServicesOf,
    actor: AnyoneMay,
) -> SignedIn:  # fmt: skip
    """Sign in by a claim, once the other device has said yes."""
    person = finish(session, body.secret)
    if person is None:
        return SignedIn(me=None)
    begin_here(session, services, request, response, person)
    return SignedIn(me=me_of(session.get_one(Person, person)))

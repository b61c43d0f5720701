"""Signing in and out: by password, by passkey, by another device that shows a QR code."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, EmailStr, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.access import BrowserMay, SignedInMay
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.cookies import known_browser, sign_in_here, sign_out_here
from walltopo_gym.accounts.device_sign_in import (
    accept_claim,
    claim_offer,
    create_offer,
    device_sign_in_of,
    use_claim,
)
from walltopo_gym.accounts.http.account import Code, Me, own_account
from walltopo_gym.accounts.limits import count_code, count_sign_in
from walltopo_gym.accounts.models import Person, SignIn
from walltopo_gym.accounts.passkeys import Site, ask_for_sign_in, person_of
from walltopo_gym.accounts.passwords import Password, Passwords
from walltopo_gym.accounts.people import find_person, normalise_email, sign_out_everywhere
from walltopo_gym.api.fields import Body, Secret
from walltopo_gym.api.services import Db, ServicesOf, network_of
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError, SignInNeededError

router = APIRouter(tags=["accounts"])


class Credentials(Body):
    """An address, a password and an optional second factor."""

    email: EmailStr
    password: Password
    code: Code | None = Field(None, description="of the second factor, where it is on")


class Browser(BaseModel):
    """A browser in which the person is signed in."""

    id: UUID
    browser: str
    created_at: datetime
    this: bool


@router.post("/session")
def begin_session(
    body: Credentials, request: Request, response: Response, services: ServicesOf, actor: BrowserMay
) -> Me:
    """Sign in. Unknown addresses and wrong passwords get the same response.

    With a second factor, the right password alone answers that a code is needed.
    """
    email = normalise_email(body.email)
    with services.database.writing() as session:
        person = find_person(session, email)
        kept = None if person is None else person.password_hash
        known = known_browser(session, request, None if person is None else person.id)
        count_sign_in(session, email, network_of(request), known)
    # Outside of any transaction: it takes a while, on purpose.
    password = body.password.get_secret_value()
    if not services.get(Passwords).matches(kept, password) or person is None or kept is None:
        raise SignInNeededError("sign-in-wrong")
    if body.code is not None:
        with services.database.writing() as session:
            count_code(session, person.id)
    fresh = (
        services.get(Passwords).hash(password) if services.get(Passwords).is_dated(kept) else None
    )
    with services.database.writing() as session:
        # Not if the password was changed meanwhile.
        found = session.scalar(
            select(Person).where(Person.id == person.id, Person.password_hash == kept)
        )
        if found is None:
            raise SignInNeededError("sign-in-wrong")
        second_factor.check(session, found.id, body.code)
        found.password_hash = fresh or kept
        sign_in_here(session, services, request, response, found.id)
        return own_account(found)


@router.delete("/session", status_code=204)
def end_session(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out in this browser."""
    session.execute(delete(SignIn).where(SignIn.id == actor.sign_in))
    sign_out_here(response)


@router.get("/me/sessions")
def list_sessions(session: Db, actor: SignedInMay) -> list[Browser]:
    """Return the browsers in which one is signed in."""
    rows = session.scalars(
        select(SignIn)
        .where(SignIn.person_id == actor.known, SignIn.expires_at > now())
        .order_by(SignIn.created_at.desc())
    )
    return [
        Browser(
            id=row.id, browser=row.browser, created_at=row.created_at, this=row.id == actor.sign_in
        )
        for row in rows
    ]


@router.delete("/me/sessions/{sign_in}", status_code=204)
def end_other_session(sign_in: UUID, session: Db, actor: SignedInMay) -> None:
    """Sign out in another browser."""
    ended = delete(SignIn).where(SignIn.id == sign_in, SignIn.person_id == actor.known)
    if session.execute(ended.returning(SignIn.id)).one_or_none() is None:
        raise NotFoundError("not-there-sign-in")
    log_change(session, "person.sign-out-other", person=actor.known, subject=str(sign_in))


@router.delete("/me/sessions", status_code=204)
def end_sessions(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out everywhere, including here."""
    sign_out_everywhere(session, actor.known)
    log_change(session, "person.sign-out-everywhere", person=actor.known)
    sign_out_here(response)


class SignedChallenge(Body):
    """The result of `navigator.credentials.get` as JSON."""

    credential: dict[str, Any]


@router.post("/session/passkey/options")
def begin_passkey_session(session: Db, services: ServicesOf, actor: BrowserMay) -> dict[str, Any]:
    """Return `PublicKeyCredentialRequestOptions` as JSON."""
    return ask_for_sign_in(session, Site(services.settings.link_base))


@router.post("/session/passkey")
def begin_session_by_passkey(
    body: SignedChallenge,
    request: Request,
    response: Response,
    services: ServicesOf,
    actor: BrowserMay,
) -> Me:
    """Sign in with a passkey."""
    with services.database.writing() as session:
        person = person_of(session, Site(services.settings.link_base), body.credential)
        sign_in_here(session, services, request, response, person)
        return own_account(session.get_one(Person, person))


class MadeDeviceSignIn(BaseModel):
    """An offer. `link` is the content of the QR code and is shown once."""

    id: UUID
    link: str
    expires_at: datetime


class DeviceSignInOut(BaseModel):
    """The state of an offer; `code` and `browser` are empty until it is claimed."""

    browser: str
    code: str
    allowed: bool


class Permission(Body):
    """The code that the other device shows."""

    code: Annotated[str, Field(pattern=r"^[0-9]{6}$")]


class SecretOnly(Body):
    secret: Secret


class MadeClaim(BaseModel):
    """A claim's secret, and the code that both devices show."""

    claim: str
    code: str


class SignedIn(BaseModel):
    """The signed-in account; null until the other device accepts."""

    me: Me | None


@router.post("/me/device-sign-ins", status_code=201)
def make_device_sign_in(session: Db, services: ServicesOf, actor: SignedInMay) -> MadeDeviceSignIn:
    """Offer to sign in on another device. An earlier offer expires."""
    assert actor.sign_in is not None  # SignedInMay lets no token in
    row, secret = create_offer(session, actor.known, actor.sign_in)
    link = f"{services.settings.link_base}/sign-in/device#{secret}"
    return MadeDeviceSignIn(id=row.id, link=link, expires_at=row.expires_at)


@router.get("/me/device-sign-ins/{device_sign_in}")
def read_device_sign_in(device_sign_in: UUID, session: Db, actor: SignedInMay) -> DeviceSignInOut:
    """Return whether the offer is claimed, and with which code."""
    row = device_sign_in_of(session, device_sign_in, actor.sign_in)
    return DeviceSignInOut.model_validate(row, from_attributes=True)


@router.post("/me/device-sign-ins/{device_sign_in}/allow", status_code=204)
def allow_device_sign_in(
    device_sign_in: UUID, body: Permission, session: Db, actor: SignedInMay
) -> None:
    """Accept the browser that shows this code."""
    accept_claim(session, device_sign_in, actor.sign_in, body.code)


@router.post("/session/device-sign-in/claim", status_code=201)
def claim_device_sign_in(
    body: SecretOnly, request: Request, session: Db, actor: BrowserMay
) -> MadeClaim:
    """Claim the offer of a QR code."""
    claimed, code = claim_offer(session, body.secret, request.headers.get("user-agent", ""))
    return MadeClaim(claim=claimed, code=code)


@router.post("/session/device-sign-in")
def begin_session_by_device_sign_in(
    body: SecretOnly,
    request: Request,
    response: Response,
    session: Db,
    services: ServicesOf,
    actor: BrowserMay,
) -> SignedIn:
    """Sign in by a claim once the other device has accepted."""
    person = use_claim(session, body.secret)
    if person is None:
        return SignedIn(me=None)
    # Not confirmed: a stolen session would confirm itself in this way.
    sign_in_here(session, services, request, response, person, confirmed=False)
    return SignedIn(me=own_account(session.get_one(Person, person)))

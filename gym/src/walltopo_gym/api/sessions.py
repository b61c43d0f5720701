"""Signing in and out, here and everywhere."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from fastapi import APIRouter, Request, Response
from pydantic import BaseModel, EmailStr, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.addresses import one_spelling
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.limits import count_code, count_sign_in
from walltopo_gym.accounts.models import Person, SignIn
from walltopo_gym.accounts.people import find_person, sign_out_everywhere
from walltopo_gym.api.cookies import begin_here, end_here, known_by
from walltopo_gym.api.fields import Body, Password
from walltopo_gym.api.me import Me, me_of
from walltopo_gym.api.rules import AnyoneMay, SignedInMay
from walltopo_gym.api.second_factor import Code
from walltopo_gym.api.services import Db, ServicesOf, network_of
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError, SignInNeededError

router = APIRouter(tags=["accounts"])


class Credentials(Body):
    """What one signs in with."""

    email: EmailStr
    password: Password
    code: Code | None = Field(None, description="of the second factor, where it is on")


class Browser(BaseModel):
    """One browser in which one is signed in."""

    id: UUID
    browser: str
    created_at: datetime
    this: bool


@router.post("/session")
def begin_session(
    body: Credentials, request: Request, response: Response, services: ServicesOf, actor: AnyoneMay
) -> Me:
    """Sign in. An address that is not known and a password that is wrong sound the same.

    Where a second factor is on, the right password alone is told that its code is needed.
    """
    email = one_spelling(body.email)
    with services.database.writing() as session:
        person = find_person(session, email)
        kept = None if person is None else person.password_hash
        known = known_by(session, request, None if person is None else person.id)
        count_sign_in(session, email, network_of(request), known)
    # Outside of any transaction: it takes a while, on purpose.
    password = body.password.get_secret_value()
    if not services.passwords.matches(kept, password) or person is None or kept is None:
        raise SignInNeededError("address or password is not right")
    if body.code is not None:
        with services.database.writing() as session:
            count_code(session, person.id)
    fresh = services.passwords.hash(password) if services.passwords.is_dated(kept) else None
    with services.database.writing() as session:
        # Not if the password was changed meanwhile.
        found = session.scalar(
            select(Person).where(Person.id == person.id, Person.password_hash == kept)
        )
        if found is None:
            raise SignInNeededError("address or password is not right")
        second_factor.check(session, found.id, body.code)
        found.password_hash = fresh or kept
        begin_here(session, services, request, response, found.id)
        return me_of(found)


@router.delete("/session", status_code=204)
def end_session(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out in this browser."""
    session.execute(delete(SignIn).where(SignIn.id == actor.sign_in))
    end_here(response)


@router.get("/me/sessions")
def list_sessions(session: Db, actor: SignedInMay) -> list[Browser]:
    """The browsers in which one is signed in."""
    rows = session.scalars(
        select(SignIn)
        .where(SignIn.person_id == actor.known, SignIn.expires_at > now())
        .order_by(SignIn.created_at.desc())
    )
    return [
        Browser(id=row.id, browser=row.browser, created_at=row.created_at,
                this=row.id == actor.sign_in)
        for row in rows
    ]  # fmt: skip


@router.delete("/me/sessions/{sign_in}", status_code=204)
def end_other_session(sign_in: UUID, session: Db, actor: SignedInMay) -> None:
    """Sign out in another browser."""
    ended = delete(SignIn).where(SignIn.id == sign_in, SignIn.person_id == actor.known)
    if session.execute(ended.returning(SignIn.id)).one_or_none() is None:
        raise NotFoundError("no such sign-in")
    log_change(session, "person.sign-out-other", person=actor.known, subject=str(sign_in))


@router.delete("/me/sessions", status_code=204)
def end_sessions(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out everywhere, here too."""
    sign_out_everywhere(session, actor.known)
    log_change(session, "person.sign-out-everywhere", person=actor.known)
    end_here(response)

"""Signing up, in and out; one's own account."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter, BackgroundTasks, Request, Response
from pydantic import BaseModel, EmailStr, Field, SecretStr
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.actor import TOKEN_PREFIX, Scope, sign_in
from walltopo_gym.accounts.addresses import one_spelling
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.letters import (
    known_already,
    reset_letter,
    sign_up_letter,
    unknown_letter,
)
from walltopo_gym.accounts.limits import (
    MAILS_PER_ADDRESS,
    MAILS_PER_CLIENT,
    SIGN_INS_PER_ACCOUNT,
    SIGN_INS_PER_CLIENT,
    count_try,
)
from walltopo_gym.accounts.mailed_links import new_link, use_link
from walltopo_gym.accounts.models import ApiToken, Person, SignIn
from walltopo_gym.accounts.passwords import LONGEST, check_password
from walltopo_gym.accounts.people import (
    add_person,
    find_person,
    set_password,
    sign_out_everywhere,
)
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.api.fields import Body, Name, Secret
from walltopo_gym.api.rules import COOKIE, AnyoneMay, SignedInMay
from walltopo_gym.api.services import Db, Services, ServicesOf, client_of
from walltopo_gym.clock import now
from walltopo_gym.errors import ForbiddenError, NotFoundError, SignInNeededError
from walltopo_gym.gyms.members import invitation

__all__ = ["router"]

router = APIRouter(tags=["accounts"])

Password = Annotated[SecretStr, Field(max_length=LONGEST)]


class SignUp(Body):
    """Who wants an account; `invitation` where the server wants one."""

    email: EmailStr
    invitation: Secret | None = None


class Confirmation(Body):
    """The link that was mailed, and what the account shall be."""

    token: Secret
    name: Name
    password: Password


class Credentials(Body):
    """What one signs in with."""

    email: EmailStr
    password: Password


class Me(BaseModel):
    """One's own account."""

    id: UUID
    email: str
    name: str
    operator: bool


class Renaming(Body):
    name: Name


class Address(Body):
    email: EmailStr


class NewPassword(Body):
    token: Secret
    password: Password


class PasswordChange(Body):
    old: Password
    new: Password


class Browser(BaseModel):
    """One browser in which one is signed in."""

    id: UUID
    browser: str
    created_at: datetime
    this: bool


class NewToken(Body):
    """A token for a program."""

    name: Name
    scopes: list[Scope] = Field(min_length=1, max_length=len(Scope))
    days: int = Field(365, ge=1, le=730)


class Token(BaseModel):
    """A token without its secret."""

    id: UUID
    name: str
    scopes: list[str]
    created_at: datetime
    expires_at: datetime


class MadeToken(Token):
    """A token just made: its secret is told this once."""

    secret: str


@router.post("/sign-up", status_code=202)
def ask_for_account(
    body: SignUp, request: Request, services: ServicesOf, later: BackgroundTasks, actor: AnyoneMay
) -> None:
    """Have a link mailed with which an account is made. Says the same for every address."""
    email = one_spelling(body.email)
    with services.database.writing() as session:
        if services.settings.sign_up == "invitation":
            if body.invitation is None:
                raise ForbiddenError("one signs up here by invitation", "Ask your gym for one.")
            invitation(session, body.invitation)
        count_try(session, MAILS_PER_CLIENT, client_of(request))
        count_try(session, MAILS_PER_ADDRESS, email)
    later.add_task(_mail_sign_up, services, email)


def _mail_sign_up(services: Services, email: str) -> None:
    """After the answer, so that its time does not tell whether there is an account."""
    base = services.settings.link_base
    with services.database.writing() as session:
        if find_person(session, email) is not None:
            letter = known_already(email, base)
        else:
            letter = sign_up_letter(email, base, new_link(session, "sign-up", email))
    services.mailer.send(letter)


@router.post("/sign-up/confirm", status_code=201)
def make_account(
    body: Confirmation, request: Request, response: Response, services: ServicesOf, actor: AnyoneMay
) -> Me:
    """Make the account, and sign in."""
    password = body.password.get_secret_value()
    check_password(password, body.name)
    kept = services.passwords.hash(password)
    with services.database.writing() as session:
        email = use_link(session, "sign-up", body.token)
        check_password(password, email, body.name)
        person = add_person(session, email, body.name, kept)
        _set_cookie(session, services, request, response, person.id)
        return _me(person)


@router.post("/session")
def begin_session(
    body: Credentials, request: Request, response: Response, services: ServicesOf, actor: AnyoneMay
) -> Me:
    """Sign in. An address that is not known and a password that is wrong sound the same."""
    email = one_spelling(body.email)
    with services.database.writing() as session:
        count_try(session, SIGN_INS_PER_CLIENT, client_of(request))
        count_try(session, SIGN_INS_PER_ACCOUNT, email)
    with services.database.reading() as session:
        person = find_person(session, email)
        kept = None if person is None else person.password_hash
    # Outside of any transaction: it takes a while, on purpose.
    password = body.password.get_secret_value()
    if not services.passwords.matches(kept, password) or person is None or kept is None:
        raise SignInNeededError("address or password is not right")
    fresh = services.passwords.hash(password) if services.passwords.is_dated(kept) else None
    with services.database.writing() as session:
        # Not if the password was changed meanwhile.
        found = session.scalar(
            select(Person).where(Person.id == person.id, Person.password_hash == kept)
        )
        if found is None:
            raise SignInNeededError("address or password is not right")
        found.password_hash = fresh or kept
        _set_cookie(session, services, request, response, found.id)
        return _me(found)


@router.delete("/session", status_code=204)
def end_session(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out in this browser."""
    session.execute(delete(SignIn).where(SignIn.id == actor.sign_in))
    _drop_cookie(response)


@router.get("/me")
def read_me(session: Db, actor: SignedInMay) -> Me:
    """One's own account."""
    return _me(session.get_one(Person, actor.known))


@router.patch("/me")
def rename_me(body: Renaming, session: Db, actor: SignedInMay) -> Me:
    """Change one's name."""
    person = session.get_one(Person, actor.known)
    person.name = body.name
    log_change(session, "person.rename", person=person.id)
    return _me(person)


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


@router.delete("/me/sessions", status_code=204)
def end_sessions(response: Response, session: Db, actor: SignedInMay) -> None:
    """Sign out everywhere, here too."""
    sign_out_everywhere(session, actor.known)
    log_change(session, "person.sign-out-everywhere", person=actor.known)
    _drop_cookie(response)


@router.put("/me/password", status_code=204)
def change_password(
    body: PasswordChange, request: Request, response: Response, services: ServicesOf,
    actor: SignedInMay,
) -> None:  # fmt: skip
    """Choose another password; every other sign-in and all tokens end."""
    with services.database.writing() as session:
        count_try(session, SIGN_INS_PER_ACCOUNT, str(actor.known))
        person = session.get_one(Person, actor.known)
    if not services.passwords.matches(person.password_hash, body.old.get_secret_value()):
        raise ForbiddenError("the old password is not right")
    with services.database.writing() as session:
        person = session.get_one(Person, actor.known)
        set_password(session, person, body.new.get_secret_value(), services.passwords)
        _set_cookie(session, services, request, response, person.id)


@router.post("/password-reset", status_code=202)
def ask_for_reset(
    body: Address, request: Request, services: ServicesOf, later: BackgroundTasks, actor: AnyoneMay
) -> None:
    """Have a link mailed with which another password is chosen. Says the same for every address."""
    email = one_spelling(body.email)
    with services.database.writing() as session:
        count_try(session, MAILS_PER_CLIENT, client_of(request))
        count_try(session, MAILS_PER_ADDRESS, email)
    later.add_task(_mail_reset, services, email)


def _mail_reset(services: Services, email: str) -> None:
    base = services.settings.link_base
    with services.database.writing() as session:
        if find_person(session, email) is None:
            letter = unknown_letter(email, base)
        else:
            letter = reset_letter(email, base, new_link(session, "reset", email))
    services.mailer.send(letter)


@router.post("/password-reset/confirm", status_code=204)
def reset_password(body: NewPassword, services: ServicesOf, actor: AnyoneMay) -> None:
    """Choose another password by a mailed link; every sign-in and all tokens end."""
    with services.database.writing() as session:
        person = find_person(session, use_link(session, "reset", body.token))
        if person is None:
            raise NotFoundError("this account is gone")
        set_password(session, person, body.password.get_secret_value(), services.passwords)


@router.get("/me/tokens")
def list_tokens(session: Db, actor: SignedInMay) -> list[Token]:
    """One's tokens for programs."""
    rows = session.scalars(
        select(ApiToken).where(ApiToken.person_id == actor.known).order_by(ApiToken.created_at)
    )
    return [Token.model_validate(row, from_attributes=True) for row in rows]


@router.post("/me/tokens", status_code=201)
def make_token(body: NewToken, session: Db, actor: SignedInMay) -> MadeToken:
    """Make a token for a program."""
    secret, kept = new_secret(TOKEN_PREFIX)
    scopes = sorted({scope.value for scope in body.scopes})
    row = ApiToken(person_id=actor.known, name=body.name, token_hash=kept, scopes=scopes,
                   expires_at=now() + timedelta(days=body.days))  # fmt: skip
    session.add(row)
    session.flush()
    log_change(session, "token.create", person=actor.known, subject=str(row.id))
    told = Token.model_validate(row, from_attributes=True)
    return MadeToken(**told.model_dump(), secret=secret)


@router.delete("/me/tokens/{token}", status_code=204)
def drop_token(token: UUID, session: Db, actor: SignedInMay) -> None:
    """End a token."""
    ended = delete(ApiToken).where(ApiToken.id == token, ApiToken.person_id == actor.known)
    if session.execute(ended.returning(ApiToken.id)).one_or_none() is None:
        raise NotFoundError("no such token")
    log_change(session, "token.delete", person=actor.known, subject=str(token))


def _me(person: Person) -> Me:
    return Me(id=person.id, email=person.email, name=person.name, operator=person.operator)


def _set_cookie(
    session: Session, services: Services, request: Request, response: Response, person: UUID
) -> None:
    """Sign in in this browser. Always a new secret: one that was planted is worth nothing."""
    days = services.settings.session_days
    secret = sign_in(session, person, request.headers.get("user-agent", ""), days)
    response.set_cookie(
        COOKIE, secret, max_age=days * 86400, path="/", secure=True, httponly=True, samesite="lax"
    )


def _drop_cookie(response: Response) -> None:
    response.delete_cookie(COOKIE, path="/", secure=True, httponly=True, samesite="lax")

"""Endpoints of one's own account: sign-up by a mailed link, name, password, second factor,
tokens."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Annotated, Literal
from uuid import UUID

from fastapi import APIRouter, BackgroundTasks, Request, Response
from pydantic import BaseModel, EmailStr, Field, SecretStr
from sqlalchemy import delete, select

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.access import BrowserMay, ConfirmedMay, SignedInMay
from walltopo_gym.accounts.actor import TOKEN_PREFIX, Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.cookies import known_browser, remember_browser, sign_in_here
from walltopo_gym.accounts.limits import count_code, count_mail
from walltopo_gym.accounts.mails import email_of_link, mail_link, use_link
from walltopo_gym.accounts.models import ApiToken, Identity, Passkey, Person
from walltopo_gym.accounts.notices import NotifyOwner
from walltopo_gym.accounts.passwords import Password, Passwords, check_own_password, check_password
from walltopo_gym.accounts.people import (
    add_person,
    find_person,
    normalise_email,
    remove_ways_in,
    set_password,
)
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.api.fields import Body, Name, Secret
from walltopo_gym.api.services import Db, Services, ServicesOf, network_of
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.languages import Language

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
    return own_account(session.get_one(Person, actor.known))


@router.patch("/me")
def rename_me(body: Renaming, session: Db, actor: SignedInMay) -> Me:
    """Change one's name."""
    person = session.get_one(Person, actor.known)
    person.name = body.name
    log_change(session, "person.rename", person=person.id)
    return own_account(person)


def own_account(person: Person) -> Me:
    """An account, for its owner."""
    return Me(id=person.id, email=person.email, name=person.name, operator=person.operator)


class Confirmation(Body):
    """The mailed link and the new account's name and password."""

    token: Secret
    name: Name
    password: Password


@router.post("/sign-up/confirm", status_code=201)
def make_account(
    body: Confirmation,
    request: Request,
    response: Response,
    services: ServicesOf,
    actor: BrowserMay,
) -> Me:
    """Create the account and sign in."""
    password = body.password.get_secret_value()
    with services.database.reading() as session:
        email = email_of_link(session, "sign-up", body.token)
    check_password(password, email, body.name)
    kept = services.get(Passwords).hash(password)
    with services.database.writing() as session:
        email = use_link(session, "sign-up", body.token)
        person = add_person(session, email, body.name, kept)
        sign_in_here(session, services, request, response, person.id)
        return own_account(person)


class EmailAddressIn(Body):
    email: EmailStr
    language: Language = "en"


class NewPassword(Body):
    """A mailed link and a new password. `keep`: ids of the ways to sign in that stay."""

    token: Secret
    password: Password
    keep: list[UUID] = Field([], max_length=100)


class PasswordChange(Body):
    """The old and the new password. `keep`: ids of the ways to sign in that stay; null: all."""

    old: Password
    new: Password
    keep: list[UUID] | None = Field(None, max_length=100)


class WayIn(BaseModel):
    """A way to sign in beside the password: a passkey, or an account at the server `name`."""

    id: UUID
    kind: Literal["passkey", "provider"]
    name: str
    created_at: datetime
    used_at: datetime | None


class ResetLink(Body):
    token: Secret


@router.put("/me/password", status_code=204)
def change_password(
    body: PasswordChange,
    request: Request,
    response: Response,
    services: ServicesOf,
    notify: NotifyOwner,
    actor: SignedInMay,
) -> None:
    """Change one's password. All other sign-ins, all tokens and all connections of apps end. The
    owner gets a mail."""
    check_own_password(services, actor.known, body.old)
    with services.database.reading() as session:
        person = session.get_one(Person, actor.known)
    kept = _new_hash(services, person, body.new)
    with services.database.writing() as session:
        person = session.get_one(Person, actor.known)
        set_password(session, person, kept)
        if body.keep is not None:
            remove_ways_in(session, person.id, body.keep)
        notify(session, person.id, "password-changed")
        sign_in_here(session, services, request, response, person.id)


@router.post("/password-reset", status_code=202)
def ask_for_reset(
    body: EmailAddressIn,
    request: Request,
    services: ServicesOf,
    later: BackgroundTasks,
    actor: BrowserMay,
) -> None:
    """Mail a link for choosing a new password. The response is the same for every address."""
    email = normalise_email(body.email)
    with services.database.writing() as session:
        person = find_person(session, email)
        known = known_browser(session, request, None if person is None else person.id)
        count_mail(session, "reset", email, network_of(request), known)
    later.add_task(mail_link, services, "reset", email, body.language)


@router.post("/password-reset/ways-in")
def list_ways_in(body: ResetLink, services: ServicesOf, actor: BrowserMay) -> list[WayIn]:
    """Return the ways to sign in to the account of a mailed link, which stays valid."""
    with services.database.reading() as session:
        person = find_person(session, email_of_link(session, "reset", body.token))
        if person is None:
            raise NotFoundError("account-gone")
        passkeys = session.scalars(select(Passkey).where(Passkey.person_id == person.id))
        identities = session.scalars(select(Identity).where(Identity.person_id == person.id))
        return [
            WayIn(
                id=row.id,
                kind="passkey",
                name=row.name,
                created_at=row.created_at,
                used_at=row.used_at,
            )
            for row in passkeys
        ] + [
            WayIn(
                id=row.id, kind="provider", name=row.issuer, created_at=row.created_at, used_at=None
            )
            for row in identities
        ]


@router.post("/password-reset/confirm", status_code=204)
def reset_password(
    body: NewPassword,
    request: Request,
    response: Response,
    services: ServicesOf,
    notify: NotifyOwner,
    actor: BrowserMay,
) -> None:
    """Choose a new password by a mailed link. All sign-ins and tokens end, and so do all other ways
    to sign in but those that are kept. The owner gets a mail.

    The server recognises this browser from now on, so that failed attempts of others cannot lock
    its owner out.
    """
    with services.database.reading() as session:
        found = find_person(session, email_of_link(session, "reset", body.token))
    kept = "" if found is None else _new_hash(services, found, body.password)
    with services.database.writing() as session:
        person = find_person(session, use_link(session, "reset", body.token))
        if person is None or not kept:
            raise NotFoundError("account-gone")
        set_password(session, person, kept)
        remove_ways_in(session, person.id, body.keep)
        notify(session, person.id, "password-changed")
        remember_browser(session, request, response, person.id)


def _new_hash(services: Services, person: Person, password: SecretStr) -> str:
    """Return the hash of a person's new password, outside of a transaction.

    Raises
    ------
    RequestError : it is short or easily guessed.
    """
    text = password.get_secret_value()
    check_password(text, person.email, person.name)
    return services.get(Passwords).hash(text)


Code = Annotated[str, Field(min_length=6, max_length=40)]


class SecondFactorOut(BaseModel):
    """Whether the second factor is on, and how many recovery codes are left."""

    on: bool
    recovery_codes_left: int


class NewSecret(BaseModel):
    """The secret of a second factor, as text and as an address for a QR code."""

    secret: str
    uri: str


class Digits(Body):
    code: Code


class RecoveryCodes(BaseModel):
    """Recovery codes, shown once. Each replaces the phone's digits once."""

    recovery_codes: list[str]


class OwnPassword(Body):
    password: Password


@router.get("/me/second-factor")
def read_second_factor(session: Db, actor: SignedInMay) -> SecondFactorOut:
    """Return whether the second factor is on."""
    return SecondFactorOut(
        on=second_factor.is_on(session, actor.known),
        recovery_codes_left=second_factor.codes_left(session, actor.known),
    )


@router.post("/me/second-factor")
def begin_second_factor(session: Db, actor: ConfirmedMay) -> NewSecret:
    """Create a secret for an authenticator app. It takes effect once confirmed."""
    secret, uri = second_factor.begin(session, session.get_one(Person, actor.known))
    return NewSecret(secret=secret, uri=uri)


@router.post("/me/second-factor/confirm")
def confirm_second_factor(
    body: Digits, services: ServicesOf, notify: NotifyOwner, actor: ConfirmedMay
) -> RecoveryCodes:
    """Turn the second factor on by showing that the phone makes the right digits. The owner gets a
    mail."""
    with services.database.writing() as session:
        count_code(session, actor.known)
    with services.database.writing() as session:
        codes = second_factor.confirm(session, actor.known, body.code)
        notify(session, actor.known, "second-factor-on")
    return RecoveryCodes(recovery_codes=codes)


@router.post("/me/second-factor/off", status_code=204)
def end_second_factor(
    body: OwnPassword, services: ServicesOf, notify: NotifyOwner, actor: SignedInMay
) -> None:
    """Turn the second factor off. The owner gets a mail."""
    check_own_password(services, actor.known, body.password)
    with services.database.writing() as session:
        second_factor.turn_off(session, actor.known, by=actor.known)
        notify(session, actor.known, "second-factor-off")


class NewToken(Body):
    """A request for an API token."""

    name: Name
    scopes: list[Scope] = Field(min_length=1, max_length=len(Scope))
    days: int = Field(365, ge=1, le=730)


class Token(BaseModel):
    """An API token without its secret."""

    id: UUID
    name: str
    scopes: list[str]
    created_at: datetime
    expires_at: datetime


class MadeToken(Token):
    """A new API token with its secret, which is shown once."""

    secret: str


@router.get("/me/tokens")
def list_tokens(session: Db, actor: SignedInMay) -> list[Token]:
    """Return one's API tokens, without those of apps."""
    mine = select(ApiToken).where(ApiToken.person_id == actor.known, ApiToken.grant_id.is_(None))
    rows = session.scalars(mine.order_by(ApiToken.created_at))
    return [Token.model_validate(row, from_attributes=True) for row in rows]


@router.post("/me/tokens", status_code=201)
def make_token(body: NewToken, session: Db, notify: NotifyOwner, actor: ConfirmedMay) -> MadeToken:
    """Create an API token. The owner gets a mail."""
    secret, kept = new_secret(TOKEN_PREFIX)
    scopes = sorted({scope.value for scope in body.scopes})
    row = ApiToken(
        person_id=actor.known,
        name=body.name,
        token_hash=kept,
        scopes=scopes,
        expires_at=now() + timedelta(days=body.days),
    )
    session.add(row)
    session.flush()
    log_change(session, "token.create", person=actor.known, subject=str(row.id))
    notify(session, actor.known, "token-added", row.name)
    facts = Token.model_validate(row, from_attributes=True)
    return MadeToken(**facts.model_dump(), secret=secret)


@router.delete("/me/tokens/{token}", status_code=204)
def drop_token(token: UUID, session: Db, notify: NotifyOwner, actor: ConfirmedMay) -> None:
    """Delete an API token. The owner gets a mail."""
    mine = ApiToken.person_id == actor.known, ApiToken.grant_id.is_(None)
    ended = delete(ApiToken).where(ApiToken.id == token, *mine)
    name = session.scalar(ended.returning(ApiToken.name))
    if name is None:
        raise NotFoundError("not-there-token")
    notify(session, actor.known, "token-removed", name)
    log_change(session, "token.delete", person=actor.known, subject=str(token))

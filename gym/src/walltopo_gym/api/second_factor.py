"""The second factor of one's own account."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter
from pydantic import BaseModel, Field

from walltopo_gym.accounts import second_factor
from walltopo_gym.accounts.limits import count_code
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body, Password
from walltopo_gym.api.own_password import check_own_password
from walltopo_gym.api.rules import SignedInMay
from walltopo_gym.api.services import Db, ServicesOf

router = APIRouter(tags=["accounts"])

Code = Annotated[str, Field(min_length=6, max_length=40)]


class SecondFactorFacts(BaseModel):
    """Whether it is asked for, and how many recovery codes are left."""

    on: bool
    recovery_codes_left: int


class NewSecret(BaseModel):
    """For the phone: the secret to type, and as an address to show as a QR code."""

    secret: str
    uri: str


class Digits(Body):
    code: Code


class RecoveryCodes(BaseModel):
    """Shown once; each is good once instead of the phone's digits."""

    recovery_codes: list[str]


class OwnPassword(Body):
    password: Password


@router.get("/me/second-factor")
def read_second_factor(session: Db, actor: SignedInMay) -> SecondFactorFacts:
    """Whether one signs in with a second factor."""
    return SecondFactorFacts(
        on=second_factor.is_on(session, actor.known),
        recovery_codes_left=second_factor.codes_left(session, actor.known),
    )


@router.post("/me/second-factor")
def begin_second_factor(session: Db, actor: SignedInMay) -> NewSecret:
    """A secret for a program on the phone; asked for when its digits were confirmed."""
    secret, uri = second_factor.begin(session, session.get_one(Person, actor.known))
    return NewSecret(secret=secret, uri=uri)


@router.post("/me/second-factor/confirm")
def confirm_second_factor(body: Digits, services: ServicesOf, actor: SignedInMay) -> RecoveryCodes:
    """Show that the phone makes the right digits; from now on signing in wants them."""
    with services.database.writing() as session:
        count_code(session, actor.known)
    with services.database.writing() as session:
        codes = second_factor.confirm(session, actor.known, body.code)
    return RecoveryCodes(recovery_codes=codes)


@router.post("/me/second-factor/off", status_code=204)
def end_second_factor(body: OwnPassword, services: ServicesOf, actor: SignedInMay) -> None:
    """Sign in by the password alone again."""
    check_own_password(services, actor.known, body.password)
    with services.database.writing() as session:
        second_factor.end(session, actor.known)

"""Another password: by the old one, or by a mailed link."""

from __future__ import annotations

from fastapi import APIRouter, BackgroundTasks, Request, Response
from pydantic import EmailStr

from walltopo_gym.accounts.addresses import one_spelling
from walltopo_gym.accounts.limits import count_mail
from walltopo_gym.accounts.mailed_links import use_link
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import find_person, set_password
from walltopo_gym.api.cookies import be_known, begin_here, known_by
from walltopo_gym.api.fields import Body, Password, Secret
from walltopo_gym.api.own_password import check_own_password
from walltopo_gym.api.rules import AnyoneMay, SignedInMay
from walltopo_gym.api.services import ServicesOf, network_of
from walltopo_gym.api.sign_up import mail_link
from walltopo_gym.errors import NotFoundError
from walltopo_gym.languages import Language

router = APIRouter(tags=["accounts"])


class Address(Body):
    email: EmailStr
    language: Language = "en"


class NewPassword(Body):
    token: Secret
    password: Password


class PasswordChange(Body):
    old: Password
    new: Password


@router.put("/me/password", status_code=204)
def change_password(
    body: PasswordChange, request: Request, response: Response, services: ServicesOf,
    actor: SignedInMay,
) -> None:  # fmt: skip
    """Choose another password; every other sign-in and all tokens end."""
    check_own_password(services, actor.known, body.old)
    with services.database.writing() as session:
        person = session.get_one(Person, actor.known)
        set_password(session, person, body.new.get_secret_value(), services.passwords)
        begin_here(session, services, request, response, person.id)


@router.post("/password-reset", status_code=202)
def ask_for_reset(
    body: Address, request: Request, services: ServicesOf, later: BackgroundTasks, actor: AnyoneMay
) -> None:
    """Have a link mailed with which another password is chosen. Says the same for every address."""
    email = one_spelling(body.email)
    with services.database.writing() as session:
        person = find_person(session, email)
        known = known_by(session, request, None if person is None else person.id)
        count_mail(session, "reset", email, network_of(request), known)
    later.add_task(mail_link, services, "reset", email, body.language)


@router.post("/password-reset/confirm", status_code=204)
def reset_password(
    body: NewPassword, request: Request, response: Response, services: ServicesOf, actor: AnyoneMay
) -> None:
    """Choose another password by a mailed link; every sign-in and all tokens end.

    The browser is known from now on: who was shut out by others' guesses signs in with it.
    """
    with services.database.writing() as session:
        person = find_person(session, use_link(session, "reset", body.token))
        if person is None:
            raise NotFoundError("this account is gone")
        set_password(session, person, body.password.get_secret_value(), services.passwords)
        be_known(session, request, response, person.id)

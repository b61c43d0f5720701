"""Signing up, by a mailed link that proves the address."""

from __future__ import annotations

from fastapi import APIRouter, BackgroundTasks, Request, Response
from pydantic import EmailStr

from walltopo_gym.accounts.addresses import one_spelling
from walltopo_gym.accounts.letters import known_already, sign_up_letter
from walltopo_gym.accounts.limits import count_mail
from walltopo_gym.accounts.mailed_links import new_link, use_link
from walltopo_gym.accounts.passwords import check_password
from walltopo_gym.accounts.people import add_person, find_person
from walltopo_gym.api.cookies import begin_here
from walltopo_gym.api.fields import Body, Name, Password, Secret
from walltopo_gym.api.me import Me, me_of
from walltopo_gym.api.rules import AnyoneMay
from walltopo_gym.api.services import Services, ServicesOf, network_of
from walltopo_gym.errors import ForbiddenError
from walltopo_gym.gyms.members import invitation

__all__ = ["router"]

router = APIRouter(tags=["accounts"])


class SignUp(Body):
    """Who wants an account; `invitation` where the server wants one."""

    email: EmailStr
    invitation: Secret | None = None


class Confirmation(Body):
    """The link that was mailed, and what the account shall be."""

    token: Secret
    name: Name
    password: Password


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
        count_mail(session, email, network_of(request))
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
        begin_here(session, services, request, response, person.id)
        return me_of(person)

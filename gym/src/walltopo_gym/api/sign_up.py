"""Signing up, by a mailed link that proves the address."""

from __future__ import annotations

from fastapi import APIRouter, BackgroundTasks, Request, Response
from pydantic import EmailStr

from walltopo_gym.accounts.addresses import one_spelling
from walltopo_gym.accounts.letters import letter_asked_for
from walltopo_gym.accounts.limits import count_mail
from walltopo_gym.accounts.mailed_links import Kind, use_link
from walltopo_gym.accounts.passwords import check_password
from walltopo_gym.accounts.people import add_person
from walltopo_gym.api.cookies import begin_here
from walltopo_gym.api.fields import Body, Name, Password, Secret
from walltopo_gym.api.me import Me, me_of
from walltopo_gym.api.rules import AnyoneMay
from walltopo_gym.api.services import Services, ServicesOf, network_of
from walltopo_gym.errors import ForbiddenError
from walltopo_gym.gyms.members import invitation
from walltopo_gym.languages import Language

router = APIRouter(tags=["accounts"])


class SignUp(Body):
    """Who wants an account; `invitation` where the server wants one."""

    email: EmailStr
    invitation: Secret | None = None
    language: Language = "en"


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
        count_mail(session, "sign-up", email, network_of(request), known=None)
    later.add_task(mail_link, services, "sign-up", email, body.language)


def mail_link(services: Services, kind: Kind, email: str, language: Language) -> None:
    """After the answer, so that its time does not tell whether there is an account."""
    with services.database.writing() as session:
        letter = letter_asked_for(session, kind, email, services.settings.link_base, language)
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

"""Message preferences, subscribed browsers, and unsubscribing without a sign-in."""

from __future__ import annotations

from typing import Annotated, Final
from uuid import UUID

from fastapi import APIRouter, Depends, Path, Request
from pydantic import BaseModel, Field
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import AnyoneMay, BrowserMay, SignedInMay
from walltopo_gym.accounts.limits import count_document
from walltopo_gym.accounts.models import Person
from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.languages import Language
from walltopo_gym.mail import sender_of
from walltopo_gym.notifications.models import Channel, NotificationPreferences, PushAddress
from walltopo_gym.notifications.preferences import preferences_of
from walltopo_gym.notifications.push import check_address, push
from walltopo_gym.notifications.secrets import person_of, public_push_key, push_key
from walltopo_gym.words import words_in

router = APIRouter(tags=["messages"])

_MAX = 20
Hour = Annotated[int, Field(ge=0, le=23)]
Base64 = r"^[A-Za-z0-9_-]+=*$"


class NewsKinds(Body):
    """Message preferences: `digest` weekly, the others at once, by push.

    `hold_reports`: to setters about new hold reports, to climbers when theirs are done. `forerun`:
    to forerunners when the routes of a planned reset are set. `inspections`: to setters when one is
    due.
    """

    digest: bool = False
    new_routes: bool = False
    soon: bool = False
    competitions: bool = False
    hold_reports: bool = False
    forerun: bool = False
    inspections: bool = False


class NewsIn(NewsKinds):
    """All message preferences; `quiet_from` and `quiet_to` are hours."""

    language: Language = "en"
    digest_by: Channel = "mail"
    quiet_from: Hour = 22
    quiet_to: Hour = 8


class PushOut(BaseModel):
    """A subscribed browser; `endpoint` identifies it."""

    id: UUID
    browser: str
    endpoint: str


class NewsOut(NewsIn):
    """Message preferences, subscribed browsers, and the server's public push `key`.

    `chosen`: whether the person has chosen before; else these are the defaults, and the app asks.
    """

    chosen: bool
    key: str
    browsers: list[PushOut]


class NewPush(Body):
    """A browser's push subscription (PushSubscription.toJSON)."""

    endpoint: str = Field(max_length=1000, pattern=r"^[\x21-\x7e]+$")
    public_key: str = Field(max_length=100, pattern=Base64)
    secret: str = Field(max_length=40, pattern=Base64)


@router.get("/me/messages")
def read_preferences(session: Db, services: ServicesOf, actor: SignedInMay) -> NewsOut:
    """Return one's own message preferences."""
    return _news_out(session, services, actor.known)


@router.put("/me/messages", status_code=204)
def put_preferences(body: NewsIn, session: Db, actor: SignedInMay) -> None:
    """Set message preferences."""
    session.merge(NotificationPreferences(person_id=actor.known, **body.model_dump()))


@router.put("/me/push")
def put_push(
    body: NewPush, request: Request, session: Db, services: ServicesOf, actor: SignedInMay
) -> PushOut:
    """Subscribe this browser, also again. Another person may have used it before."""
    private = services.settings.webhooks_to_private
    check_address(body.endpoint, body.public_key, body.secret, private=private)
    take_turn(session, f"push {actor.known}")
    row = session.scalar(select(PushAddress).where(PushAddress.endpoint == body.endpoint))
    if row is not None and row.person_id != actor.known:
        session.delete(row)
        session.flush()
        row = None
    if row is None:
        mine = select(func.count()).where(PushAddress.person_id == actor.known)
        if (session.scalar(mine) or 0) >= _MAX:
            raise ConflictError("push-too-many", "push-remove", most=_MAX)
        row = PushAddress(person_id=actor.known, endpoint=body.endpoint)
        session.add(row)
    row.public_key, row.secret = body.public_key, body.secret
    row.browser = request.headers.get("user-agent", "")[:200]
    session.flush()
    return PushOut.model_validate(row, from_attributes=True)


@router.delete("/me/push/{browser}", status_code=204)
def drop_push(browser: UUID, session: Db, actor: SignedInMay) -> None:
    """Unsubscribe a browser."""
    session.delete(_own_browser(session, actor.known, browser))


@router.post("/me/push/{browser}/trial", status_code=204)
def try_push(browser: UUID, services: ServicesOf, actor: SignedInMay) -> None:
    """Send a test message to a browser now."""
    with services.database.writing() as session:
        count_document(session, actor.known)
        row = _own_browser(session, actor.known, browser)
        words = words_in(preferences_of(session, actor.known).language)
    body = {
        "title": words.say("push_try"),
        "text": words.say("push_try_text"),
        "path": "/me/messages",
        "tag": "trial",
    }
    settings = services.settings
    try:
        push(
            row,
            body,
            push_key(services.database),
            sender_of(settings),
            private=settings.webhooks_to_private,
        )
    except NotFoundError:
        with services.database.writing() as session:
            session.delete(_own_browser(session, actor.known, browser))
        raise
    except OSError as error:
        raise ConflictError("push-not-taken", "push-later") from error


def _person_of_link(token: Annotated[str, Path(max_length=60)], services: ServicesOf) -> UUID:
    """Return the person whose mail has the link."""
    person = person_of(services.database, token)
    with services.database.reading() as session:
        if person is None or session.get(Person, person) is None:
            raise NotFoundError("mail-link-unknown", "mails-link-newer")
    return person


Whose = Annotated[UUID, Depends(_person_of_link)]


@router.get("/unsubscribe/{token}")
def read_preferences_by_link(person: Whose, services: ServicesOf, actor: AnyoneMay) -> NewsKinds:
    """Return the preferences of the person whose mail has the link."""
    with services.database.reading() as session:
        return NewsKinds.model_validate(preferences_of(session, person), from_attributes=True)


@router.put("/unsubscribe/{token}", status_code=204)
def put_preferences_by_link(
    person: Whose, body: NewsKinds, services: ServicesOf, actor: BrowserMay
) -> None:
    """Turn messages off or on by the link of a mail."""
    with services.database.writing() as session:
        preferences = preferences_of(session, person)
        for name, value in body.model_dump().items():
            setattr(preferences, name, value)
        session.add(preferences)


@router.post("/unsubscribe/{token}", status_code=204)
def end_mails(person: Whose, services: ServicesOf, actor: BrowserMay) -> None:
    """Turn the week's summary off by the mail program's own button (RFC 8058)."""
    with services.database.writing() as session:
        row = session.get(NotificationPreferences, person)
        if row is not None:
            row.digest = False


def _news_out(session: Session, services: ServicesOf, person: UUID) -> NewsOut:
    mine = select(PushAddress).where(PushAddress.person_id == person)
    preferences = preferences_of(session, person)
    words = NewsIn.model_validate(preferences, from_attributes=True)
    return NewsOut(
        **words.model_dump(),
        chosen=preferences in session,
        key=public_push_key(services.database),
        browsers=[
            PushOut.model_validate(row, from_attributes=True)
            for row in session.scalars(mine.order_by(PushAddress.created_at))
        ],
    )


def _own_browser(session: Session, person: UUID, browser: UUID) -> PushAddress:
    row = session.get(PushAddress, browser)
    if row is None or row.person_id != person:
        raise NotFoundError("push-unknown")
    return row


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

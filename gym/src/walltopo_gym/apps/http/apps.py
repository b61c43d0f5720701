"""Endpoints of registered apps, of a person's consent, and of connected apps."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated
from uuid import UUID

from fastapi import APIRouter
from pydantic import AfterValidator, BaseModel, Field
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import ConfirmedMay, SignedInMay
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.limits import count_app, count_authorization
from walltopo_gym.accounts.models import App, Person
from walltopo_gym.accounts.notices import NotifyOwner
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.apps.authorization import (
    AuthorizationError,
    AuthorizationRequest,
    approve,
    read_request,
)
from walltopo_gym.apps.redirects import check_redirect, shown_target
from walltopo_gym.apps.registry import (
    AppFacts,
    apps_of,
    change_app,
    connected_apps,
    disconnect_app,
    drop_app,
    own_app,
    register_app,
    renew_secret,
)

router = APIRouter(tags=["apps"])


def _without_repeats(addresses: list[str]) -> list[str]:
    return list(dict.fromkeys(addresses))


# Shorter than their column: a program on a device may add a port.
_Redirect = Annotated[str, Field(min_length=1, max_length=450)]
# No account before the host: it looks like another host.
_HomePage = Annotated[
    str,
    Field(
        max_length=450,
        pattern=r"^https?://[A-Za-z0-9\-._~:\[\]%]+([/?][A-Za-z0-9\-._~:/?\[\]@!$&'()*+,;=%]*)?$",
    ),
]


class AppIn(Body):
    """An app. `home_page`: its web page; `redirects`: the addresses that may get its codes."""

    name: Name
    home_page: _HomePage
    redirects: Annotated[list[_Redirect], AfterValidator(_without_repeats)] = Field(
        min_length=1, max_length=10
    )

    def facts(self) -> AppFacts:
        """Return the checked facts.

        Raises
        ------
        RequestError : a redirect address is not allowed.
        """
        for address in self.redirects:
            check_redirect(address)
        return AppFacts(self.name, self.home_page, self.redirects)


class NewApp(AppIn):
    """A new app; `confidential`: it runs on a server and can keep a secret."""

    confidential: bool = False


class AppOut(BaseModel):
    """A registered app. `id` is its client id; `confidential`: it has a secret."""

    id: UUID
    name: str
    home_page: str
    redirects: list[str]
    confidential: bool
    created_at: datetime


class MadeApp(AppOut):
    """A new app with its secret, which is shown once; empty for a public client."""

    secret: str


class AppSecret(BaseModel):
    """A new secret, which is shown once."""

    secret: str


@router.get("/me/apps")
def list_apps(session: Db, actor: SignedInMay) -> list[AppOut]:
    """Return the apps that one has registered."""
    return [_app_out(row) for row in apps_of(session, actor.known)]


@router.post("/me/apps", status_code=201)
def make_app(body: NewApp, services: ServicesOf, actor: ConfirmedMay) -> MadeApp:
    """Register an app."""
    facts = body.facts()
    with services.database.writing() as session:
        count_app(session, actor.known)
    with services.database.writing() as session:
        row, secret = register_app(session, actor.known, facts, confidential=body.confidential)
        return MadeApp(**_app_out(row).model_dump(), secret=secret)


@router.put("/me/apps/{app}")
def put_app(app: UUID, body: AppIn, session: Db, actor: ConfirmedMay) -> AppOut:
    """Change an app that one has registered. People keep it connected."""
    row = own_app(session, actor.known, app)
    change_app(session, row, body.facts())
    return _app_out(row)


@router.post("/me/apps/{app}/secret")
def renew_app_secret(app: UUID, session: Db, actor: ConfirmedMay) -> AppSecret:
    """Give an app a new secret; the old one ends at once."""
    return AppSecret(secret=renew_secret(session, own_app(session, actor.known, app)))


@router.delete("/me/apps/{app}", status_code=204)
def delete_app(app: UUID, session: Db, actor: ConfirmedMay) -> None:
    """Delete an app that one has registered. It ends for everybody."""
    drop_app(session, own_app(session, actor.known, app))


def _app_out(row: App) -> AppOut:
    return AppOut(
        id=row.id,
        name=row.name,
        home_page=row.home_page,
        redirects=row.redirects,
        confidential=row.password_hash is not None,
        created_at=row.created_at,
    )


class AuthorizationIn(Body):
    """The query of the app's link to `/oauth/authorize`."""

    query: str = Field(max_length=4000)


class ConsentOut(BaseModel):
    """The question to a person whether an app may act for them.

    `maker`: name of the person who registered it. `target`: host or scheme to which the browser
    goes. `scopes`: those that the app wants; `known`: those of them that it has by now.
    `declined`: where the browser goes if the person declines.
    """

    name: str
    home_page: str
    maker: str
    target: str
    scopes: list[Scope]
    known: list[Scope]
    declined: str


class AuthorizationOut(BaseModel):
    """The question to show; null: the browser goes to `address` at once, with an error for the
    app."""

    consent: ConsentOut | None
    address: str


class Approved(BaseModel):
    """The address to which the browser goes with the code for the app."""

    address: str


@router.post("/me/authorizations/check")
def check_authorization(
    body: AuthorizationIn, session: Db, services: ServicesOf, actor: SignedInMay
) -> AuthorizationOut:
    """Return the question whether an app may act for oneself. Nothing is allowed by this."""
    try:
        found = read_request(session, services.settings.link_base, body.query)
    except AuthorizationError as error:
        return AuthorizationOut(consent=None, address=error.address)
    return AuthorizationOut(consent=_consent(session, actor.known, found), address="")


def _consent(session: Session, person: UUID, request: AuthorizationRequest) -> ConsentOut:
    app = request.app
    held = {
        scope
        for row in connected_apps(session, person)
        if row.app == app.id
        for scope in row.scopes
    }
    return ConsentOut(
        name=app.name,
        home_page=app.home_page,
        maker=session.get_one(Person, app.person_id).name,
        target=shown_target(request.redirect),
        scopes=list(request.scopes),
        known=[scope for scope in request.scopes if scope in held],
        declined=request.answer(error="access_denied", error_description="the person declined"),
    )


@router.post("/me/authorizations", status_code=201)
def authorize_app(
    body: AuthorizationIn, services: ServicesOf, notify: NotifyOwner, actor: ConfirmedMay
) -> Approved:
    """Let an app act for oneself. The owner gets a mail."""
    with services.database.writing() as session:
        count_authorization(session, actor.known)
    with services.database.writing() as session:
        try:
            found = read_request(session, services.settings.link_base, body.query)
        except AuthorizationError as error:
            return Approved(address=error.address)
        address = approve(session, actor.known, found)
        notify(session, actor.known, "app-connected", found.app.name)
        return Approved(address=address)


class ConnectedApp(BaseModel):
    """An app that acts for a person. `maker`: name of the person who registered it; `used_at`: when
    it last fetched tokens, each of which is good for an hour."""

    id: UUID
    name: str
    home_page: str
    maker: str
    scopes: list[Scope]
    created_at: datetime
    used_at: datetime | None


@router.get("/me/connected-apps")
def list_connected_apps(session: Db, actor: SignedInMay) -> list[ConnectedApp]:
    """Return the apps that act for oneself."""
    return [
        ConnectedApp.model_validate(row, from_attributes=True)
        for row in connected_apps(session, actor.known)
    ]


@router.delete("/me/connected-apps/{connection}", status_code=204)
def drop_connected_app(connection: UUID, session: Db, actor: SignedInMay) -> None:
    """Disconnect an app. All of its tokens end at once."""
    disconnect_app(session, actor.known, connection)

"""Registered apps of a person, and the apps that are connected to a person's account."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy import delete, func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import App, AppConnection, AppGrant, Person
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.clock import now
from walltopo_gym.database.engine import take_turn
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.events import OwnTables, RowsExpired

_MOST: Final = 20  # apps of one person
_SECRET_PREFIX: Final = "wtgs_"


@dataclass(frozen=True)
class AppFacts:
    """A developer's description of an app.

    Parameters
    ----------
    home_page, redirects : addresses, checked by the caller.
    """

    name: str
    home_page: str
    redirects: Sequence[str]


def apps_of(session: Session, person: UUID) -> Sequence[App]:
    """Return the apps that a person registered, the oldest first."""
    mine = select(App).where(App.person_id == person).order_by(App.created_at)
    return session.scalars(mine).all()


def own_app(session: Session, person: UUID, app: UUID) -> App:
    """Return an app that a person registered.

    Raises
    ------
    NotFoundError : it does not exist, or is another person's.
    """
    found = session.get(App, app)
    if found is None or found.person_id != person:
        raise NotFoundError("not-there-app")
    return found


def register_app(
    session: Session, person: UUID, facts: AppFacts, *, confidential: bool
) -> tuple[App, str]:
    """Register an app and return it with its secret; a public client has none ("").

    Raises
    ------
    ConflictError : the person has registered as many as anybody may.
    """
    take_turn(session, f"apps {person}")
    count = select(func.count()).select_from(App).where(App.person_id == person)
    if (session.scalar(count) or 0) >= _MOST:
        raise ConflictError("apps-most", most=_MOST)
    secret, kept = new_secret(_SECRET_PREFIX) if confidential else ("", None)
    row = App(person_id=person, password_hash=kept, **_app_columns(facts))
    session.add(row)
    session.flush()
    _log_app(session, "app.create", row)
    return row, secret


def change_app(session: Session, row: App, facts: AppFacts) -> None:
    """Change the facts of an app. People keep it connected."""
    for name, value in _app_columns(facts).items():
        setattr(row, name, value)
    _log_app(session, "app.change", row)


def renew_secret(session: Session, row: App) -> str:
    """Return a new secret of a confidential app; the old one ends at once.

    Raises
    ------
    ConflictError : it is a public client.
    """
    if row.password_hash is None:
        raise ConflictError("app-public")
    secret, row.password_hash = new_secret(_SECRET_PREFIX)
    _log_app(session, "app.secret", row)
    return secret


def drop_app(session: Session, row: App) -> None:
    """Delete an app, with the connections of all people."""
    session.delete(row)
    _log_app(session, "app.delete", row)


def _log_app(session: Session, action: str, row: App) -> None:
    log_change(session, action, person=row.person_id, subject=row.name, app=str(row.id))


def _app_columns(facts: AppFacts) -> dict[str, object]:
    return {
        "name": facts.name,
        "home_page": facts.home_page,
        "redirects": list(facts.redirects),
    }


@dataclass(frozen=True)
class Connected:
    """An app that acts for a person.

    Parameters
    ----------
    maker : name of the person who registered it. scopes : of all consents that are in force.
    used_at : when it last fetched tokens; None: not yet.
    """

    id: UUID
    app: UUID
    name: str
    home_page: str
    maker: str
    scopes: tuple[str, ...]
    created_at: datetime
    used_at: datetime | None


def connected_apps(session: Session, person: UUID) -> list[Connected]:
    """Return the apps that can act for a person, the last used first."""
    rows = session.execute(
        select(AppConnection, App, Person.name)
        .join(App, App.id == AppConnection.app_id)
        .join(Person, Person.id == App.person_id)
        .where(AppConnection.person_id == person)
        .order_by(AppConnection.used_at.desc().nulls_last(), App.name)
    ).all()
    granted = scopes_in_force(session, [connection.id for connection, _, _ in rows])
    return [
        Connected(
            id=connection.id,
            app=app.id,
            name=app.name,
            home_page=app.home_page,
            maker=maker,
            scopes=tuple(sorted(granted[connection.id])),
            created_at=connection.created_at,
            used_at=connection.used_at,
        )
        for connection, app, maker in rows
        if granted[connection.id]
    ]


def scopes_in_force(session: Session, connections: Sequence[UUID]) -> dict[UUID, set[str]]:
    """Return the scopes of connections by grants whose tokens are good."""
    found: dict[UUID, set[str]] = {connection: set() for connection in connections}
    grants = select(AppGrant.connection_id, AppGrant.scopes).where(
        AppGrant.connection_id.in_(connections),
        AppGrant.used_at.is_not(None),
        AppGrant.expires_at > now(),
    )
    for connection, scopes in session.execute(grants):
        found[connection].update(scopes)
    return found


def disconnect_app(session: Session, person: UUID, connection: UUID) -> None:
    """End all tokens of an app for a person.

    Raises
    ------
    NotFoundError : it is not connected to this person's account.
    """
    row = session.get(AppConnection, connection)
    if row is None or row.person_id != person:
        raise NotFoundError("not-there-connection")
    name = session.get_one(App, row.app_id).name
    session.delete(row)
    log_change(session, "app.disconnect", person=person, subject=name, app=str(row.app_id))


def own_tables(session: Session, question: OwnTables) -> None:
    """Name the tables of apps that have a person's rows."""
    question.found.extend([("apps", App), ("app_connections", AppConnection)])


def drop_expired(session: Session, question: RowsExpired) -> None:
    """Delete grants whose tokens have all expired, and connections without a grant."""
    old = delete(AppGrant).where(AppGrant.expires_at < now()).returning(AppGrant.id)
    question.found.append(len(session.scalars(old).all()))
    bare = AppConnection.id.not_in(select(AppGrant.connection_id))
    gone = delete(AppConnection).where(bare).returning(AppConnection.id)
    question.found.append(len(session.scalars(gone).all()))

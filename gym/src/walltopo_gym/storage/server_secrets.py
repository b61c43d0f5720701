"""Secrets of the server, created when first needed and shared by all of its processes: they are in
the database, and so in its backups."""

from __future__ import annotations

from collections.abc import Callable

from sqlalchemy import select
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from walltopo_gym.database.engine import Database
from walltopo_gym.storage.models import ServerSecret


def known_secret(session: Session, name: str) -> str | None:
    """Return a secret by its name; None if it was not made yet."""
    return session.scalar(select(ServerSecret.content).where(ServerSecret.name == name))


def stored_secret(database: Database, name: str, make: Callable[[], str]) -> str:
    """Return a secret by its name; `make` makes it if there is none."""
    with database.reading() as session:
        content = known_secret(session, name)
    if content is None:
        try:
            with database.writing() as session:
                session.add(ServerSecret(name=name, content=make()))
        except IntegrityError:
            pass  # another process made it at the same moment
        with database.reading() as session:
            content = known_secret(session, name)
        assert content is not None
    return content

"""Secrets of the server, created when first needed and shared by all of its processes: they are in
the database, and so in its backups."""

from __future__ import annotations

from collections.abc import Callable

from sqlalchemy import select
from sqlalchemy.exc import IntegrityError

from walltopo_gym.database.engine import Database
from walltopo_gym.storage.models import ServerSecret


def stored_secret(database: Database, name: str, make: Callable[[], str]) -> str:
    """Return a secret by its name; `make` makes it if there is none."""
    query = select(ServerSecret.content).where(ServerSecret.name == name)
    with database.reading() as session:
        content = session.scalar(query)
    if content is None:
        try:
            with database.writing() as session:
                session.add(ServerSecret(name=name, content=make()))
        except IntegrityError:
            pass  # another process made it at the same moment
        with database.reading() as session:
            content = session.scalars(query).one()
    return content

"""The first steps of a restored gym, and the id of a server among those that share a target."""

from __future__ import annotations

import secrets
from typing import Final

from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from walltopo_gym.clock import now
from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import migrate
from walltopo_gym.storage.models import BackupRun, ServerSecret
from walltopo_gym.storage.server_secrets import known_secret, stored_secret

OPEN_STATES: Final = ("queued", "running", "waiting")  # of a run of a backup
_SERVER: Final = "server"


def server_id(database: Database) -> str:
    """Return the id of this server in the names of its backups: 8 hex digits."""
    return stored_secret(database, _SERVER, lambda: secrets.token_hex(4))


def known_server_id(session: Session) -> str:
    """Return the id of this server; empty if it has made no backup."""
    return known_secret(session, _SERVER) or ""


def prepare_restored(database: Database, server: str = "") -> None:
    """Give a restored database the tables of this version and an id of its server.

    No worker resumes the runs that were open when the backup was made. A copy of a gym that goes on
    elsewhere is another server, so it deletes none of that gym's backups.

    Parameters
    ----------
    server : id of the server whose data this replaces; empty: a new one when it is first needed.
    """
    migrate(database)
    with database.writing() as session:
        for row in session.scalars(select(BackupRun).where(BackupRun.state.in_(OPEN_STATES))):
            row.state, row.ended_at = "done", now()
        session.execute(delete(ServerSecret).where(ServerSecret.name == _SERVER))
        if server:
            session.add(ServerSecret(name=_SERVER, content=server))

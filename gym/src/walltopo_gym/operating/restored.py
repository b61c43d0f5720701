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


def prepare_restored(database: Database) -> None:
    """Give a restored database the tables of this version, and let it be another server.

    No worker resumes the runs that were open when the backup was made. With an id of its own, a
    copy of a gym that goes on elsewhere deletes none of that gym's backups.
    """
    migrate(database)
    with database.writing() as session:
        for row in session.scalars(select(BackupRun).where(BackupRun.state.in_(OPEN_STATES))):
            row.state, row.ended_at = "done", now()
        session.execute(delete(ServerSecret).where(ServerSecret.name == _SERVER))

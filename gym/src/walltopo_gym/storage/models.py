"""Tables of the measured use of the file store, of runs of backups, of the server's secrets, and of
counted requests."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, ForeignKey, String, Text
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class StorageUse(Keyed, Base):
    """The files of a kind that a gym uses, at the last measurement.

    `gym_id`: null for files that no gym names. A file of several gyms counts for each.
    """

    __tablename__ = "storage_use"

    gym_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("gyms.id", ondelete="CASCADE"), index=True
    )
    kind: Mapped[str] = mapped_column(String(20))
    files: Mapped[int]
    bytes: Mapped[int] = mapped_column(BigInteger)
    measured_at: Mapped[datetime] = mapped_column(default=now)


class BackupRun(Keyed, Base):
    """One run that makes a backup at the target, tries one again or restores it.

    Parameters
    ----------
    kind : "make", "try" or "restore". name : of the backup at the target.
    state : "queued", "running", "waiting" (for its next try), "done" or "failed".
    step, done, total : progress; done and total are numbers of files.
    error : why the last try failed.
    """

    __tablename__ = "backup_runs"

    kind: Mapped[str] = mapped_column(String(10))
    name: Mapped[str] = mapped_column(String(100))
    state: Mapped[str] = mapped_column(String(10), default="queued")
    step: Mapped[str] = mapped_column(String(10), default="")
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int] = mapped_column(default=0)
    ended_at: Mapped[datetime | None] = mapped_column(index=True)
    error: Mapped[str] = mapped_column(String(500), default="")


class ServerSecret(Base):
    """A secret of the server, created once and shared by all of its processes."""

    __tablename__ = "server_secrets"

    name: Mapped[str] = mapped_column(String(40), primary_key=True)
    content: Mapped[str] = mapped_column(Text)


class RequestCount(Base):
    """The requests of a network in one window of time, at all servers together.

    `key`: a hash of network and window, so that no address is stored.
    """

    __tablename__ = "request_counts"

    key: Mapped[str] = mapped_column(String(64), primary_key=True)
    count: Mapped[int]
    at: Mapped[datetime] = mapped_column(index=True, default=now)

"""The table of what background jobs have tried."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base


class JobAttempt(Base):
    """An item of a background job that was begun and is not done.

    `kind`: of the job; `item`: id of the row that it works on; `version`: of that row, where a new
    one is tried anew. `tries` so far. `holder`: the worker or queue that has it now, empty between
    two tries. `next_at`: when it is tried again, or taken from a holder that was killed; empty once
    it is set aside. `error`: why the last try failed, for the operator.
    """

    __tablename__ = "job_attempts"

    kind: Mapped[str] = mapped_column(String(20), primary_key=True)
    item: Mapped[UUID] = mapped_column(primary_key=True)
    version: Mapped[str] = mapped_column(String(80), default="")
    tries: Mapped[int] = mapped_column(default=0)
    holder: Mapped[str] = mapped_column(String(200), default="")
    begun_at: Mapped[datetime] = mapped_column(default=now)
    next_at: Mapped[datetime | None]
    error: Mapped[str] = mapped_column(String(300), default="")

"""Tables of scans and of how their jobs go."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class Scan(Keyed, Base):
    """One version of a wall.

    `state` is one of `states.State`; `run` counts the jobs that were begun for it; `reference_id`
    is the scan in whose frame it lies; `error` and `hint` say in a setter's words what went wrong.
    """

    __tablename__ = "scans"

    wall_id: Mapped[UUID] = mapped_column(ForeignKey("walls.id", ondelete="CASCADE"), index=True)
    made_by: Mapped[UUID | None] = mapped_column(ForeignKey("people.id", ondelete="SET NULL"))
    state: Mapped[str] = mapped_column(String(12), index=True)
    run: Mapped[int] = mapped_column(default=0)
    reference_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", ondelete="SET NULL"), index=True
    )
    error: Mapped[str] = mapped_column(String(2000), default="")
    hint: Mapped[str] = mapped_column(String(2000), default="")
    files: Mapped[dict[str, Any]] = mapped_column(JSON, default=dict)
    published_at: Mapped[datetime | None]


class ScanProgress(Base):
    """How far a running scan is: a row that is written over, `at` when it was last heard of."""

    __tablename__ = "scan_progress"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    stage: Mapped[str] = mapped_column(String(20), default="")
    doing: Mapped[str] = mapped_column(String(200), default="")
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int | None]
    notes: Mapped[list[str]] = mapped_column(JSON, default=list)
    at: Mapped[datetime] = mapped_column(default=now)


class Worker(Base):
    """A worker, and when it was last heard of."""

    __tablename__ = "workers"

    name: Mapped[str] = mapped_column(String(200), primary_key=True)
    at: Mapped[datetime]

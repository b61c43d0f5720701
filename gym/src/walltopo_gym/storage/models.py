"""Table of the measured use of the file store."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import BigInteger, ForeignKey, String
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

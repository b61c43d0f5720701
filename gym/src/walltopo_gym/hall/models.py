"""Table of the screen in the hall."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base


class HallSettings(Base):
    """A gym's screen settings; `screen.DEFAULT` without a row.

    `parts` in order; each is shown for `seconds`; routes are new for `days`; `board`: whether the
    screen shows the people who agreed to it. `key_hash`: hash of the secret that opens a private
    gym's screen.
    """

    __tablename__ = "hall_settings"

    gym_id: Mapped[UUID] = mapped_column(
        ForeignKey("gyms.id", ondelete="CASCADE"), primary_key=True
    )
    parts: Mapped[list[str]] = mapped_column(JSON)
    seconds: Mapped[int]
    days: Mapped[int]
    board: Mapped[bool]
    key_hash: Mapped[str | None] = mapped_column(String(64), unique=True)
    key_made_at: Mapped[datetime | None]

"""Following: whose sessions one likes to see, with their leave."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, delete, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from walltopo.core import InputError
from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.climbing.bans import Ban
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base
from walltopo_gym.errors import NotFoundError

__all__ = ["Follow"]


class Follow(Base):
    """`follower_id` would like to see what `followed_id` climbs; does so once it is `accepted`."""

    __tablename__ = "follows"

    follower_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True
    )
    followed_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    accepted: Mapped[bool]
    created_at: Mapped[datetime] = mapped_column(default=now)

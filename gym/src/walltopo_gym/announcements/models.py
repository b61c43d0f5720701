"""Table of announcements."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import JSON
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.languages import Language


class Announcement(Keyed, Base):
    """A text that the app shows to everybody from `starts_at` to `ends_at`; null: without an end.

    `texts`: the text by language.
    """

    __tablename__ = "announcements"

    texts: Mapped[dict[Language, str]] = mapped_column(JSON)
    starts_at: Mapped[datetime]
    ends_at: Mapped[datetime | None]

"""Table of climbs elsewhere."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

MAX_NAME, MAX_GRADE, MAX_NOTE = 120, 40, 4_000


class OtherAscent(Keyed, Base):
    """An ascent that no gym of this server knows, entered by hand or imported.

    The phone makes `id`, or the import derives it from the line, so that each is stored once.
    `venue`: "outdoors", "gym" or "board". `discipline`: of `walls.disciplines`, or empty for an
    unknown one. `kind`: "onsight", "flash", "top", "repeat", "try" or "project". `climbed_at`:
    noon UTC of a day without a time. `source`: of the import, else empty. `withdrawn_at`: deleted
    by the person; the row stays without its words, so that a second import adds nothing.
    """

    __tablename__ = "other_ascents"
    __table_args__ = (Index("ix_other_ascents_of", "person_id", "climbed_at"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"))
    venue: Mapped[str] = mapped_column(String(10))
    discipline: Mapped[str] = mapped_column(String(10))
    name: Mapped[str] = mapped_column(String(MAX_NAME))
    location: Mapped[str] = mapped_column(String(MAX_NAME))
    grade: Mapped[str] = mapped_column(String(MAX_GRADE))
    kind: Mapped[str] = mapped_column(String(10))
    tries: Mapped[int]
    note: Mapped[str] = mapped_column(String(MAX_NOTE))
    climbed_at: Mapped[datetime]
    source: Mapped[str] = mapped_column(String(20))
    withdrawn_at: Mapped[datetime | None]

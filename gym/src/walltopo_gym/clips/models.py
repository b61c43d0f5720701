"""Tables of clips and the attempts that they show, and of reports on films."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, BigInteger, ForeignKey, Index, String, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed


class Clip(Keyed, Base):
    """A clip of an attempt at a route; its person alone sees it. The video goes when it is read.

    `scan_id`: the version of the wall that was published when the clip was announced; the ids of
    holds are those of this version. `state` is one of `service.ClipState`. `phase`, `done`,
    `total`: the step of the reading, and its frames. `fault`: why it could not be read, one of
    `reader.Fault`. `attempt`: an `AttemptFile` as plain values. `holds`: of the route, the lowest
    first. `moves`: the sequence that the person confirmed, as {"limb", "hold", "time_s"}.
    `wants_film`: a film is made (`films.py`); `film_size`: its bytes, None without one.
    `published_at`: since then the route shows the film.
    """

    __tablename__ = "clips"
    __table_args__ = (Index("ix_clips_of_person", "person_id", "route_id"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"))
    route_id: Mapped[UUID] = mapped_column(ForeignKey("routes.id", ondelete="CASCADE"), index=True)
    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"), index=True)
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str | None] = mapped_column(String(64))
    state: Mapped[str] = mapped_column(String(10), index=True)
    phase: Mapped[str] = mapped_column(String(10), default="")
    done: Mapped[int] = mapped_column(default=0)
    total: Mapped[int | None]
    fault: Mapped[str] = mapped_column(String(20), default="")
    attempt: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    holds: Mapped[list[int]] = mapped_column(JSON, default=list)
    moves: Mapped[list[dict[str, Any]] | None] = mapped_column(JSON(none_as_null=True))
    confirmed_at: Mapped[datetime | None]
    wants_film: Mapped[bool] = mapped_column(default=False, server_default=false())
    film_size: Mapped[int | None] = mapped_column(BigInteger)
    published_at: Mapped[datetime | None]

    @property
    def film(self) -> str:
        """Return the key of the film in the store of files."""
        return f"films/{self.id}"

    @property
    def video(self) -> str:
        """Return the key of the video in the store of files."""
        return f"clips/{self.id}"


class FilmReport(Keyed, Base):
    """A person reports a film; deleted when the gym decides."""

    __tablename__ = "film_reports"
    __table_args__ = (UniqueConstraint("clip_id", "person_id"),)

    clip_id: Mapped[UUID] = mapped_column(ForeignKey("clips.id", ondelete="CASCADE"))
    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"), index=True)
    reason: Mapped[str] = mapped_column(String(200), default="")

"""The tables of photos and videos, and of what was found out about them together."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import JSON, BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

MOST_THUMBNAILS: Final = 12  # of one video, spread over it


class Photo(Keyed, Base):
    """One photo of a scan, or a video.

    `state`: "receiving" until all bytes are here, "received" until somebody looked at it, then
    "usable" or "unusable" with the `reason`. `sha256` is what the sender said until then. `frames`
    is 1 for a photo; of a video, how many frames a scan takes.
    """

    __tablename__ = "photos"

    scan_id: Mapped[UUID] = mapped_column(ForeignKey("scans.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(200))
    size: Mapped[int] = mapped_column(BigInteger)
    state: Mapped[str] = mapped_column(String(10), index=True)
    reason: Mapped[str] = mapped_column(String(500), default="")
    sha256: Mapped[str | None] = mapped_column(String(64), index=True)
    width: Mapped[int | None]
    height: Mapped[int | None]
    sharpness: Mapped[float | None]
    frames: Mapped[int] = mapped_column(default=1)

    @property
    def original(self) -> str:
        """Key of the file as it came, with all that a phone writes into it: for scans alone."""
        return f"originals/{self.sha256}"

    @property
    def thumbnail(self) -> str:
        """Key of a small picture of its pixels alone."""
        return self.thumbnail_of(0)

    def thumbnail_of(self, number: int) -> str:
        """Key of a small picture of the photo (0), or of one of a video's frames."""
        return f"thumbnails/{self.sha256}{f'-{number}' if number else ''}.jpg"

    @property
    def thumbnails(self) -> list[str]:
        """Keys of all small pictures."""
        return [self.thumbnail_of(number) for number in range(min(self.frames, MOST_THUMBNAILS))]


class PhotoOverlap(Base):
    """Which photos of a scan hang together by what they show.

    `asked` counts how often the photos changed, `answered` is the count that `groups` are of: lists
    of photos' ids, the largest first; empty where it was left, for there are too many.
    """

    __tablename__ = "photo_overlaps"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    asked: Mapped[int]
    answered: Mapped[int]
    groups: Mapped[list[list[str]]] = mapped_column(JSON)

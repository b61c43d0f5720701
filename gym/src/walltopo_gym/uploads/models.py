"""The table of photos."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy import BigInteger, ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base, Keyed

__all__ = ["Photo"]


class Photo(Keyed, Base):
    """One photo of a scan.

    `state`: "receiving" until all bytes are here, "received" until somebody looked at it, then
    "usable" or "unusable" with the `reason`. `sha256` is what the sender said until then.
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

    @property
    def original(self) -> str:
        """Key of the file as it came, with all that a phone writes into it: for scans alone."""
        return f"originals/{self.sha256}"

    @property
    def thumbnail(self) -> str:
        """Key of a small picture of its pixels alone."""
        return f"thumbnails/{self.sha256}.jpg"

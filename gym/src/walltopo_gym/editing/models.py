"""The table of logs of edits."""

from __future__ import annotations

from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.database.base import Base


class ScanEdits(Base):
    """What setters corrected of a scan.

    `log` is `walltopo.scans.edits.EditLog` as plain values; `revision` counts the saves; `shown` is
    the revision that the scan's files show.
    """

    __tablename__ = "scan_edits"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    revision: Mapped[int] = mapped_column(default=0)
    shown: Mapped[int] = mapped_column(default=0)
    log: Mapped[dict[str, Any]] = mapped_column(JSON)

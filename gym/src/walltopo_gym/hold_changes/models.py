"""Tables of comparisons between versions, and of the holds that changed."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, String
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class HoldComparison(Base):
    """The comparison of a published version, hold by hold, with an earlier scan of the wall.

    `since_id`: the earlier version, null after its deletion; `since`: when it was published.
    `compared`: the number of holds that both show, null until the comparison is through. `error`:
    why it failed, else empty.
    """

    __tablename__ = "hold_comparisons"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("scans.id", ondelete="CASCADE"), primary_key=True
    )
    since_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", ondelete="SET NULL"), index=True
    )
    since: Mapped[datetime]
    created_at: Mapped[datetime] = mapped_column(default=now)
    compared: Mapped[int | None]
    error: Mapped[str] = mapped_column(String(500), default="")


class HoldChange(Keyed, Base):
    """A hold that changed, though its route stayed, as photos show it.

    `kind`: "turned", "moved", "gone" or "new". `hold`: its id in the version `scan_id`, null for
    one that is gone. `route_id`: null for a hold without a route. `colour`: of the hold.
    `turn_deg`: counter-clockwise, seen from the climber; `moved_m`: metres along the wall; both
    null unless it turned or moved. `done_at`: null until a setter has looked after it.
    """

    __tablename__ = "hold_changes"

    scan_id: Mapped[UUID] = mapped_column(
        ForeignKey("hold_comparisons.scan_id", ondelete="CASCADE"), index=True
    )
    hold: Mapped[int | None]
    route_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), index=True
    )
    colour: Mapped[str] = mapped_column(String(40), default="")
    kind: Mapped[str] = mapped_column(String(10))
    turn_deg: Mapped[float | None]
    moved_m: Mapped[float | None]
    done_at: Mapped[datetime | None]

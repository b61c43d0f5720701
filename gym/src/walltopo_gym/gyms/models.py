"""Tables of gyms."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed

_GYM = "gyms.id"


class Gym(Keyed, Base):
    """A climbing gym.

    `visibility`: "public" is listed, "unlisted" is seen by whoever has its address, "private" by
    its members. `joining`: "open" or "invitation". `boards`: "off", "one" for everybody, or
    "categories" too.
    """

    __tablename__ = "gyms"

    slug: Mapped[str] = mapped_column(String(60), unique=True)
    name: Mapped[str] = mapped_column(String(80))
    place: Mapped[str] = mapped_column(String(120), default="")
    time_zone: Mapped[str] = mapped_column(String(60), default="UTC")
    visibility: Mapped[str] = mapped_column(String(10), default="private")
    joining: Mapped[str] = mapped_column(String(10), default="invitation")
    boards: Mapped[str] = mapped_column(String(10), default="one", server_default="one")


class Membership(Base):
    """Somebody's role in a gym."""

    __tablename__ = "memberships"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    role: Mapped[str] = mapped_column(String(10))
    created_at: Mapped[datetime] = mapped_column(default=now)


class Ban(Base):
    """Somebody who may do no more in a gym than a stranger, until the gym lets them again.

    It outlives their membership, so that neither a link nor an open door brings them back.
    """

    __tablename__ = "bans"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    reason: Mapped[str] = mapped_column(String(200), default="")
    created_at: Mapped[datetime] = mapped_column(default=now)


class Invitation(Keyed, Base):
    """A link that makes whoever opens it a member; good `uses` times."""

    __tablename__ = "invitations"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), index=True)
    role: Mapped[str] = mapped_column(String(10))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]
    uses: Mapped[int]


class GradeSystem(Keyed, Base):
    """How a gym says how hard a route is; `grades` from the easiest to the hardest.

    `kind`: "font", "v", "circuits" or "own". A grade is {"label"} with, for a circuit, {"colour"}
    and the range {"low", "high"} in Font or V.
    """

    __tablename__ = "grade_systems"
    __table_args__ = (UniqueConstraint("gym_id", "name"),)

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(60))
    kind: Mapped[str] = mapped_column(String(10))
    grades: Mapped[list[dict[str, Any]]] = mapped_column(JSON)


class FloorPlan(Base):
    """A picture of a gym from above; `sha256` is its content's, in the store below `plans/`."""

    __tablename__ = "floor_plans"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    sha256: Mapped[str] = mapped_column(String(64))
    width: Mapped[int]
    height: Mapped[int]


class Wall(Keyed, Base):
    """A section with its own series of scans; `place` orders them from left to right.

    `zone`: walls that are set together, empty for none; `published_scan_id` is what the public
    sees; `revision` grows with every change of it; `plan_x`, `plan_y`: where it is on the gym's
    floor plan, as parts of its width and height from the upper left corner.
    """

    __tablename__ = "walls"
    __table_args__ = (UniqueConstraint("gym_id", "name"),)

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(80))
    place: Mapped[int] = mapped_column(default=0)
    zone: Mapped[str] = mapped_column(String(80), default="")
    published_scan_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("scans.id", use_alter=True, ondelete="SET NULL")
    )
    revision: Mapped[int] = mapped_column(default=0)
    plan_x: Mapped[float | None]
    plan_y: Mapped[float | None]

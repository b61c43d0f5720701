"""Tables of gyms."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import date, datetime
from typing import Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from sqlalchemy import JSON, ForeignKey, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.settings import Switch

_GYM = "gyms.id"

# Marks of columns in `info`, by which gyms/grade_uses.py finds what has a gym's grades.
# A column with a label; the mark is the column of its table that names the system or the route.
GRADE_BY: Final = "grade_by"
# A JSON column with rows of grades; the mark is their keys of system and label.
GRADE_ROWS: Final = "grade_rows"


class Gym(Keyed, Base):
    """A climbing gym.

    `visibility`: "public" is listed, "unlisted" is open to people with its address, "private" to
    its members. `joining`: "open" or "invitation". `boards`: "off", "one" for everybody, or
    "categories" too. `features_off`: optional features of the server that the gym has turned off;
    their data stays. `features_barred`: those that an operator has turned off for it.
    `storage_quota_mb`: uploads are refused above it; null: no limit. `units`: "metric" or
    "imperial", in which lengths are shown. `paper`: "a4" or "letter", for what is printed.
    """

    __tablename__ = "gyms"

    slug: Mapped[str] = mapped_column(String(60), unique=True)
    name: Mapped[str] = mapped_column(String(80))
    place: Mapped[str] = mapped_column(String(120), default="")
    time_zone: Mapped[str] = mapped_column(String(60), default="UTC")
    visibility: Mapped[str] = mapped_column(String(10), default="private")
    joining: Mapped[str] = mapped_column(String(10), default="invitation")
    boards: Mapped[str] = mapped_column(String(10), default="one", server_default="one")
    features_off: Mapped[list[Switch]] = mapped_column(JSON, default=list, server_default="[]")
    features_barred: Mapped[list[Switch]] = mapped_column(JSON, default=list, server_default="[]")
    storage_quota_mb: Mapped[int | None]
    units: Mapped[str] = mapped_column(String(8), default="metric", server_default="metric")
    paper: Mapped[str] = mapped_column(String(6), default="a4", server_default="a4")

    def features(self, of: Iterable[Switch]) -> list[Switch]:
        """Return those of a server's features that the gym has."""
        return [feature for feature in of if self.has(feature)]

    def has(self, feature: Switch | None) -> bool:
        """Return whether neither the gym nor an operator has turned a feature off."""
        return feature not in self.features_off and feature not in self.features_barred

    def today(self) -> date:
        """Return the calendar day in the gym's time zone; a day of climbing ends later
        (climbing/visits.py)."""
        return now().astimezone(ZoneInfo(self.time_zone)).date()


class Membership(Base):
    """A person's role in a gym."""

    __tablename__ = "memberships"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    role: Mapped[str] = mapped_column(String(10))
    created_at: Mapped[datetime] = mapped_column(default=now)


class Ban(Base):
    """A person with fewer rights in a gym than a stranger, until the ban is lifted.

    It outlives their membership, so that neither a link nor an open gym brings them back.
    """

    __tablename__ = "bans"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    reason: Mapped[str] = mapped_column(String(200), default="")
    created_at: Mapped[datetime] = mapped_column(default=now)


class Invitation(Keyed, Base):
    """A link that makes its visitors members, `uses` times."""

    __tablename__ = "invitations"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), index=True)
    role: Mapped[str] = mapped_column(String(10))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    expires_at: Mapped[datetime]
    uses: Mapped[int]


class GradeSystem(Keyed, Base):
    """A gym's grade system; `grades` from the easiest to the hardest.

    `kind`: "font", "v", "french", "uiaa", "circuits" or "own". A grade is {"label"}
    with, for a circuit, {"colour"} and the range {"low", "high"} in Font or V.
    """

    __tablename__ = "grade_systems"
    __table_args__ = (UniqueConstraint("gym_id", "name"),)

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    name: Mapped[str] = mapped_column(String(60))
    kind: Mapped[str] = mapped_column(String(10))
    grades: Mapped[list[dict[str, Any]]] = mapped_column(JSON)

    @property
    def labels(self) -> list[str]:
        """The labels of the grades, from the easiest to the hardest."""
        return [str(grade["label"]) for grade in self.grades]

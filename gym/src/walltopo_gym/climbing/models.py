"""Tables of ascents and opinions."""

from __future__ import annotations

from datetime import datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.climbing.edits import Edited
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed


class Ascent(Edited, Keyed, Base):
    """What somebody did on a route; `id` is made by their phone, so that it arrives once.

    `kind`: "flash", "top", "zone", "try" or "project"; `tries` of that day. It outlives the route
    and the gym: `gym_name`, `route_name` and `grade` are those of the day on which it arrived.
    `note`: for the climber alone.
    `taken_back_at`: it counts no more; the row stays, so that a late copy does not bring it back.
    `worth`: points of a top by that grade, and `circuit` its label where it is one (`points.py`);
    None until it was valued. `climbed_route`: the route's id, kept when the route is gone.
    `pinned_at`: one that its climber wants to be remembered by.
    """

    __tablename__ = "ascents"
    __table_args__ = (
        Index("ix_ascents_person_id_climbed_at", "person_id", "climbed_at"),
        Index("ix_ascents_person_id_gym_id_climbed_at", "person_id", "gym_id", "climbed_at"),
        # Tallies are read from it alone.
        Index("ix_ascents_counts", "route_id", "kind", "person_id", "taken_back_at"),
    )

    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"))
    gym_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("gyms.id", ondelete="SET NULL"), index=True
    )
    route_id: Mapped[UUID | None] = mapped_column(ForeignKey("routes.id", ondelete="SET NULL"))
    gym_name: Mapped[str] = mapped_column(String(80))
    route_name: Mapped[str] = mapped_column(String(80))
    grade: Mapped[str] = mapped_column(String(80))
    kind: Mapped[str] = mapped_column(String(10))
    tries: Mapped[int]
    note: Mapped[str] = mapped_column(String(500), default="")
    climbed_at: Mapped[datetime]
    taken_back_at: Mapped[datetime | None]
    worth: Mapped[int | None]
    circuit: Mapped[str] = mapped_column(String(80), default="", server_default="")
    climbed_route: Mapped[UUID | None]
    pinned_at: Mapped[datetime | None]


class Opinion(Edited, Base):
    """What somebody thinks of a route; one a person and route.

    `grade` is a label of the route's grade system or empty; `stars` 1 to 5; `wish`: "", "keep" or
    "renew".
    """

    __tablename__ = "opinions"
    __table_args__ = (Index("ix_opinions_newest", "route_id", "changed_at"),)

    route_id: Mapped[UUID] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    grade: Mapped[str] = mapped_column(String(80), default="")
    stars: Mapped[int | None]
    wish: Mapped[str] = mapped_column(String(10), default="")
    comment: Mapped[str] = mapped_column(String(500), default="")
    changed_at: Mapped[datetime] = mapped_column(default=now)


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


class HiddenComment(Base):
    """The gym shows a person's comment on a route to nobody else, whatever becomes of its words."""

    __tablename__ = "hidden_comments"

    route_id: Mapped[UUID] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    created_at: Mapped[datetime] = mapped_column(default=now)


class Report(Keyed, Base):
    """Somebody (`person_id`) finds that a comment should not be there; gone when the gym decided.

    `comment` is as it read then: its author may have changed it since.
    """

    __tablename__ = "reports"
    __table_args__ = (UniqueConstraint("route_id", "author_id", "person_id"),)

    route_id: Mapped[UUID] = mapped_column(ForeignKey("routes.id", ondelete="CASCADE"))
    author_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"), index=True)
    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"), index=True)
    comment: Mapped[str] = mapped_column(String(500))
    reason: Mapped[str] = mapped_column(String(200), default="")

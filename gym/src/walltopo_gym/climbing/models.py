"""Tables of ascents, opinions and follows; sessions and standings counted from them."""

from __future__ import annotations

from datetime import date, datetime
from uuid import UUID

from sqlalchemy import ForeignKey, Index, String, UniqueConstraint
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.climbing.edits import Edited
from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed
from walltopo_gym.gyms.models import GRADE_BY


class Ascent(Edited, Keyed, Base):
    """An ascent of a route. The phone makes `id`, so that it is stored once.

    `kind`: of `kinds.Kind`; `tries` of that day. `discipline`: of `walls.disciplines`;
    `high_point`: number of the highest clip, for that kind alone. The row outlives route
    and gym: `gym_name`, `route_name` and `grade` are those of the day on which it arrived. `note`
    is private. `taken_back_at`: withdrawn; the row stays, so that a late copy does not revive it.
    `worth`: points of a top by that grade, None until computed; `circuit`: the grade's label if it
    is a circuit (`points.py`). `climbed_route`: the route's id, kept after the route is deleted.
    `pinned_at`: pinned to the profile.
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
    discipline: Mapped[str] = mapped_column(String(10), default="boulder", server_default="boulder")
    high_point: Mapped[int | None]
    note: Mapped[str] = mapped_column(String(500), default="")
    climbed_at: Mapped[datetime]
    taken_back_at: Mapped[datetime | None]
    worth: Mapped[int | None]
    circuit: Mapped[str] = mapped_column(String(80), default="", server_default="")
    climbed_route: Mapped[UUID | None]
    pinned_at: Mapped[datetime | None]


class Opinion(Edited, Base):
    """A person's opinion of a route.

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
    grade: Mapped[str] = mapped_column(String(80), default="", info={GRADE_BY: "route_id"})
    stars: Mapped[int | None]
    wish: Mapped[str] = mapped_column(String(10), default="")
    comment: Mapped[str] = mapped_column(String(500), default="")
    changed_at: Mapped[datetime] = mapped_column(default=now)


class Follow(Base):
    """`follower_id` follows `followed_id`; a request until it is `accepted`."""

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
    """A comment hidden by the gym; later edits of it stay hidden."""

    __tablename__ = "hidden_comments"

    route_id: Mapped[UUID] = mapped_column(
        ForeignKey("routes.id", ondelete="CASCADE"), primary_key=True
    )
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey("people.id", ondelete="CASCADE"), primary_key=True, index=True
    )
    created_at: Mapped[datetime] = mapped_column(default=now)


class Report(Keyed, Base):
    """A person (`person_id`) reports a comment; deleted when the gym decides.

    `comment` is the reported text: its author may have changed it since.
    """

    __tablename__ = "reports"
    __table_args__ = (UniqueConstraint("route_id", "author_id", "person_id"),)

    route_id: Mapped[UUID] = mapped_column(ForeignKey("routes.id", ondelete="CASCADE"))
    author_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"), index=True)
    person_id: Mapped[UUID] = mapped_column(ForeignKey("people.id", ondelete="CASCADE"), index=True)
    comment: Mapped[str] = mapped_column(String(500))
    reason: Mapped[str] = mapped_column(String(200), default="")


_PERSON, _GYM = "people.id", "gyms.id"


class SessionMark(Keyed, Base):
    """A manual start (`kind` "start") or end ("end") of a session."""

    __tablename__ = "session_marks"
    __table_args__ = (Index("ix_session_marks_of", "person_id", "gym_id", "at"),)

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), index=True)
    kind: Mapped[str] = mapped_column(String(5))
    at: Mapped[datetime]


class ClimbingSession(Keyed, Base):
    """The ascents of one visit: those between `began_at` and `ended_at`, both included.

    `day` is by the gym's clock; `closed`: ended by hand; `tries` of all ascents but projects;
    `tops`, `flashes` and `points` count each route once; `hardest` is the label of the hardest top.
    """

    __tablename__ = "climbing_sessions"
    __table_args__ = (
        Index("ix_climbing_sessions_of", "person_id", "gym_id", "began_at"),
        Index("ix_climbing_sessions_feed", "gym_id", "began_at"),
    )

    person_id: Mapped[UUID] = mapped_column(ForeignKey(_PERSON, ondelete="CASCADE"))
    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"))
    day: Mapped[date]
    began_at: Mapped[datetime]
    ended_at: Mapped[datetime]
    closed: Mapped[bool]
    ascents: Mapped[int]
    tries: Mapped[int]
    tops: Mapped[int]
    flashes: Mapped[int]
    points: Mapped[int]
    hardest: Mapped[str] = mapped_column(String(80))
    hardest_worth: Mapped[int]


class Standing(Base):
    """A person's score on a board, before filters and ranks.

    `period`: "2026-03", "2026" or "all", by the gym's days; `discipline`: as `counted_as` has it;
    `circuit`: a label of a grade system of circuits, or empty for all routes. `points` by
    `points.py`; `tops` and `flashes` count each route once.
    """

    __tablename__ = "standings"
    __table_args__ = (
        Index("ix_standings_order", "gym_id", "period", "discipline", "circuit", "points"),
    )

    gym_id: Mapped[UUID] = mapped_column(ForeignKey(_GYM, ondelete="CASCADE"), primary_key=True)
    period: Mapped[str] = mapped_column(String(7), primary_key=True)
    discipline: Mapped[str] = mapped_column(String(10), primary_key=True, server_default="boulder")
    circuit: Mapped[str] = mapped_column(String(80), primary_key=True)
    person_id: Mapped[UUID] = mapped_column(
        ForeignKey(_PERSON, ondelete="CASCADE"), primary_key=True, index=True
    )
    points: Mapped[int]
    tops: Mapped[int]
    flashes: Mapped[int]

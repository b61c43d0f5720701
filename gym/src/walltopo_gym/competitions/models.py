"""Tables of competitions."""

from __future__ import annotations

from datetime import datetime
from typing import Any
from uuid import UUID

from sqlalchemy import JSON, ForeignKey, Index, String, Text, UniqueConstraint, false
from sqlalchemy.orm import Mapped, mapped_column

from walltopo_gym.clock import now
from walltopo_gym.database.base import Base, Keyed

_COMPETITION = "competitions.id"
_ENTRY = "competition_entries.id"
_PERSON = "people.id"


class Competition(Keyed, Base):
    """A competition of a gym.

    `format`: how rounds make one ranking (sheet.py); `state`: "draft" (only setters see it), "open"
    (for entries), "running" or "ended". `fee` is a note. `revision` grows with every change but a
    score, `last_seq` with every score event: writing one locks this row, so that events are
    committed in the order of their numbers. `frozen_at`: later results are for judges only.
    `late_minutes`: how long after a round's end a climber's own results may arrive. `league_best`:
    number of rounds of a league that count, `team_size`: number of members of a team that count;
    null for all.
    """

    __tablename__ = "competitions"

    gym_id: Mapped[UUID] = mapped_column(ForeignKey("gyms.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    format: Mapped[str] = mapped_column(String(10))
    state: Mapped[str] = mapped_column(String(10), default="draft")
    about: Mapped[str] = mapped_column(String(2000), default="")
    fee: Mapped[str] = mapped_column(String(200), default="")
    waiver: Mapped[str] = mapped_column(Text, default="")
    starts_at: Mapped[datetime | None]
    ends_at: Mapped[datetime | None]
    self_entry: Mapped[bool] = mapped_column(default=False)
    self_scoring: Mapped[bool] = mapped_column(default=False)
    late_minutes: Mapped[int] = mapped_column(default=60)
    league_best: Mapped[int | None]
    team_size: Mapped[int | None]
    frozen_at: Mapped[datetime | None]
    revision: Mapped[int] = mapped_column(default=0)
    last_seq: Mapped[int] = mapped_column(default=0)


class Category(Base):
    """A group that is ranked together; without bounds it is open to all."""

    __tablename__ = "competition_categories"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    competition_id: Mapped[UUID] = mapped_column(
        ForeignKey(_COMPETITION, ondelete="CASCADE"), index=True
    )
    place: Mapped[int]
    name: Mapped[str] = mapped_column(String(80))
    gender: Mapped[str] = mapped_column(String(10), default="")
    born_from: Mapped[int | None]
    born_to: Mapped[int | None]


class Round(Base):
    """A part of a competition with its own problems and rules.

    `scoring`: the rules and their numbers (scoring/rules.py). `quota`: number of each category that
    advance from the round before; null: all entries. `begun_at`: when it began. `max_attempts`:
    limit of attempts on each problem; null: none. `isolation_minutes`: how long before `opens_at`
    isolation closes; `rotation_seconds`: time between the starts of two competitors; null: none.
    """

    __tablename__ = "competition_rounds"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    competition_id: Mapped[UUID] = mapped_column(
        ForeignKey(_COMPETITION, ondelete="CASCADE"), index=True
    )
    place: Mapped[int]
    name: Mapped[str] = mapped_column(String(80))
    kind: Mapped[str] = mapped_column(String(20))
    scoring: Mapped[dict[str, Any]] = mapped_column(JSON)
    quota: Mapped[int | None]
    state: Mapped[str] = mapped_column(String(10), default="waiting")
    opens_at: Mapped[datetime | None]
    closes_at: Mapped[datetime | None]
    begun_at: Mapped[datetime | None]
    max_attempts: Mapped[int | None]
    isolation_minutes: Mapped[int | None]
    rotation_seconds: Mapped[int | None]


class Wave(Base):
    """A time in which some of the competitors of a self-scored round climb; `places`: limit of
    competitors who enter themselves, null: none."""

    __tablename__ = "competition_waves"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    round_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_rounds.id", ondelete="CASCADE"), index=True
    )
    place: Mapped[int]
    name: Mapped[str] = mapped_column(String(80))
    starts_at: Mapped[datetime]
    ends_at: Mapped[datetime]
    places: Mapped[int | None]


class Problem(Base):
    """A problem of a round. `name`, `colour`, `grade` and `wall` are copied from the route when the
    problem is made, and outlive it. `points`: own {flash, top, zone}; `category_ids`: its
    categories, empty for all; `holds`: number of a route's holds, if known."""

    __tablename__ = "competition_problems"

    id: Mapped[UUID] = mapped_column(primary_key=True)
    round_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_rounds.id", ondelete="CASCADE"), index=True
    )
    place: Mapped[int]
    label: Mapped[str] = mapped_column(String(20), default="")
    route_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("routes.id", ondelete="SET NULL"), index=True
    )
    name: Mapped[str] = mapped_column(String(80), default="")
    colour: Mapped[str] = mapped_column(String(40), default="")
    grade: Mapped[str] = mapped_column(String(80), default="")
    wall: Mapped[str] = mapped_column(String(80), default="")
    points: Mapped[dict[str, int] | None] = mapped_column(JSON(none_as_null=True))
    category_ids: Mapped[list[str]] = mapped_column(JSON, default=list)
    holds: Mapped[int | None]


class Entry(Keyed, Base):
    """A competitor, with an account (`person_id`) or without; `handicap` in points, for leagues.

    `removed`: withdrawn by the gym, so only the gym can re-enter them. `wave_id`: the wave in which
    they climb the first round.
    """

    __tablename__ = "competition_entries"
    __table_args__ = (
        UniqueConstraint("competition_id", "bib"),
        UniqueConstraint("competition_id", "person_id"),
    )

    competition_id: Mapped[UUID] = mapped_column(ForeignKey(_COMPETITION, ondelete="CASCADE"))
    category_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_categories.id", ondelete="CASCADE"), index=True
    )
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    bib: Mapped[int]
    name: Mapped[str] = mapped_column(String(80))
    team: Mapped[str] = mapped_column(String(80), default="")
    club: Mapped[str] = mapped_column(String(80), default="")
    birth_year: Mapped[int | None]
    gender: Mapped[str] = mapped_column(String(10), default="")
    handicap: Mapped[int] = mapped_column(default=0)
    withdrawn: Mapped[bool] = mapped_column(default=False)
    removed: Mapped[bool] = mapped_column(default=False, server_default=false())
    wave_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("competition_waves.id", ondelete="SET NULL"), index=True
    )


class WaiverSignature(Keyed, Base):
    """An entry's accepted text. `person_id`: the account that accepted it, or recorded the
    paper."""

    __tablename__ = "competition_waivers"

    entry_id: Mapped[UUID] = mapped_column(ForeignKey(_ENTRY, ondelete="CASCADE"), index=True)
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    on_paper: Mapped[bool]
    signed_by: Mapped[str] = mapped_column(String(80))
    text: Mapped[str] = mapped_column(Text)


class Starter(Base):
    """An entry of a round with a quota, and its place in the running order."""

    __tablename__ = "competition_starters"

    round_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_rounds.id", ondelete="CASCADE"), primary_key=True
    )
    entry_id: Mapped[UUID] = mapped_column(
        ForeignKey(_ENTRY, ondelete="CASCADE"), primary_key=True, index=True
    )
    place: Mapped[int]


class JudgeLink(Keyed, Base):
    """A link by which a browser without an account judges one problem. `token_hash`: of its
    secret; `person_id`: who made it; `revoked_at`: when it was revoked."""

    __tablename__ = "competition_judge_links"

    problem_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_problems.id", ondelete="CASCADE"), index=True
    )
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    revoked_at: Mapped[datetime | None]


class LinkJudge(Keyed, Base):
    """A browser that opened a judge's link, and the name that its judge typed. `token_hash`: of the
    secret in its cookie; `used_at`: when it opened the link or sent a score last."""

    __tablename__ = "competition_link_judges"

    link_id: Mapped[UUID] = mapped_column(
        ForeignKey("competition_judge_links.id", ondelete="CASCADE"), index=True
    )
    name: Mapped[str] = mapped_column(String(80))
    token_hash: Mapped[str] = mapped_column(String(64), unique=True)
    used_at: Mapped[datetime] = mapped_column(default=now)


class ScoreEvent(Base):
    """A score, decision or other statement; never changed, never deleted (ledger.py has the
    meaning).

    `id`, `device`, `number` and `made_at` come from the device, `seq` and `at` from the server.
    `climbed_at` is `made_at` corrected by the known error of the device's clock. `hold`, `plus` and
    `seconds` are a high point on a route and the climbing time to it or to the top. The sender is
    an account (`person_id`) or a judge by link (`link_judge_id`).
    """

    __tablename__ = "score_events"
    __table_args__ = (
        UniqueConstraint("competition_id", "seq"),
        Index("ix_score_events_entry_id_problem_id", "entry_id", "problem_id"),
    )

    id: Mapped[UUID] = mapped_column(primary_key=True)
    competition_id: Mapped[UUID] = mapped_column(ForeignKey(_COMPETITION, ondelete="CASCADE"))
    seq: Mapped[int]
    entry_id: Mapped[UUID] = mapped_column(ForeignKey(_ENTRY, ondelete="CASCADE"))
    problem_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("competition_problems.id", ondelete="CASCADE"), index=True
    )
    kind: Mapped[str] = mapped_column(String(10))
    n: Mapped[int | None]
    hold: Mapped[int | None]
    plus: Mapped[bool] = mapped_column(default=False, server_default=false())
    seconds: Mapped[int | None]
    target_id: Mapped[UUID | None]
    text: Mapped[str] = mapped_column(String(500), default="")
    person_id: Mapped[UUID | None] = mapped_column(
        ForeignKey(_PERSON, ondelete="SET NULL"), index=True
    )
    link_judge_id: Mapped[UUID | None] = mapped_column(
        ForeignKey("competition_link_judges.id", ondelete="SET NULL"), index=True
    )
    device: Mapped[str] = mapped_column(String(40))
    number: Mapped[int]
    made_at: Mapped[datetime]
    climbed_at: Mapped[datetime]
    at: Mapped[datetime] = mapped_column(default=now)

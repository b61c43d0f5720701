"""Find one's own clips, and confirm what was read in them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from itertools import pairwise
from typing import Any, Final
from uuid import UUID

from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from walltopo.scans.attempt import AttemptFile, MovingLimb
from walltopo.scans.document import parse
from walltopo_climb.movement.sequence import LIMBS
from walltopo_gym.clips.models import Clip
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.jobs.queue import Job
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.walls.models import Wall

MAX_SECONDS: Final = 60
# A planned stop of the worker interrupts a reading, which is no fault of the clip.
CLIPS: Final = Job("clips", at_once=1, of_one_gym=1, waits=(60.0,), restarts=20)


class ClipState(StrEnum):
    """The state of a clip; a read one is confirmed by its person, or deleted."""

    RECEIVING = "receiving"
    SENT = "sent"
    READING = "reading"
    READ = "read"
    UNREADABLE = "unreadable"


PENDING: Final = (ClipState.SENT, ClipState.READING)


@dataclass(frozen=True)
class ReadMove:
    """A move as it was read; `hold` is 0 for the wall itself."""

    limb: MovingLimb
    hold: int
    time_s: float
    confidence: float


@dataclass(frozen=True)
class Correction:
    """A move that the person confirms: its number among those that were read, and its hold."""

    number: int
    hold: int


def route_number(session: Session, route: UUID, scan: UUID) -> int | None:
    """Return the number of a route in a version of its wall; None if it is not in it."""
    placed = select(Placement.number).where(Placement.route_id == route, Placement.scan_id == scan)
    return session.scalar(placed)


def clips_in(gym: UUID, person: UUID) -> Select[Clip]:
    """Return the query of a person's clips in a gym."""
    return (
        select(Clip)
        .join(Route, Route.id == Clip.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Clip.person_id == person, Wall.gym_id == gym)
    )


def clip_of(session: Session, gym: UUID, clip: UUID, person: UUID) -> Clip:
    """Return a person's own clip in a gym.

    Raises
    ------
    NotFoundError : there is none.
    """
    row = session.scalar(clips_in(gym, person).where(Clip.id == clip))
    if row is None:
        raise NotFoundError("not-there-clip")
    return row


def own_clips(
    session: Session, gym: UUID, person: UUID, route: UUID | None, most: int
) -> Sequence[Clip]:
    """Return a person's latest clips in a gym, of one route if it is given, the newest first."""
    mine = clips_in(gym, person).order_by(Clip.created_at.desc(), Clip.id)
    if route is not None:
        mine = mine.where(Clip.route_id == route)
    return session.scalars(mine.limit(most)).all()


def attempt_in(clip: Clip) -> AttemptFile | None:
    """Return the attempt that was read in a clip; None before that."""
    return None if clip.attempt is None else parse(clip.attempt, AttemptFile, "attempt")


def moves_of(attempt: AttemptFile) -> list[ReadMove]:
    """Return the moves of an attempt until the top, each with the hold that its limb reaches."""
    end = math.inf if attempt.top is None else attempt.top
    return [
        ReadMove(move.limb, move.holds[LIMBS.index(move.limb)], move.time, move.confidence)
        for move in attempt.moves
        if move.limb != "start" and move.time <= end
    ]


def confirm_clip(clip: Clip, corrections: Sequence[Correction]) -> None:
    """Store the sequence that its person confirms; moves that are left out were not made.

    Raises
    ------
    ConflictError : the clip is not read. RequestError : a move was not read, or comes twice, or its
        hold is neither the one that was read nor one of the route.
    """
    attempt = attempt_in(clip)
    if attempt is None:
        raise ConflictError("clip-not-read")
    moves = moves_of(attempt)
    numbers = [one.number for one in corrections]
    if any(one >= next_one for one, next_one in pairwise(numbers)):
        raise RequestError("clip-move-unknown")
    confirmed: list[dict[str, Any]] = []
    for one in corrections:
        if not 0 <= one.number < len(moves):
            raise RequestError("clip-move-unknown")
        move = moves[one.number]
        if one.hold not in (move.hold, *clip.holds):
            raise RequestError("clip-hold-unknown")
        confirmed.append({"limb": move.limb, "hold": one.hold, "time_s": move.time_s})
    clip.moves, clip.confirmed_at = confirmed, now()

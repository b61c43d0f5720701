"""Endpoints of one's own clips, and of how climbers climb a route."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final, Literal
from uuid import UUID

import msgspec
from fastapi import APIRouter, Query, Response
from fastapi.responses import JSONResponse
from pydantic import BaseModel, Field

from walltopo.scans.attempt import MovingLimb
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.api.fields import Body
from walltopo_gym.api.services import Db, ServicesOf
from walltopo_gym.clips.beta import HandOrder, RouteBeta, beta_of
from walltopo_gym.clips.films import may_publish
from walltopo_gym.clips.http.uploads import ClimberMay
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.replay import replay_of
from walltopo_gym.clips.service import (
    MAX_SECONDS,
    ClipState,
    Correction,
    attempt_in,
    clip_of,
    confirm_clip,
    moves_of,
    own_clips,
)
from walltopo_gym.gyms.access import Access, GuestMay, gym_rule
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.versions import route_of
from walltopo_gym.scans.incoming import Incoming

router = APIRouter(tags=["clips"])

ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]

_MAX_MOVES: Final = 500
_SHOWN: Final = 20


class ClipMove(BaseModel):
    """A limb arrives at a hold, in seconds of the clip; `hold` is 0 for the wall itself."""

    limb: MovingLimb
    hold: int
    time_s: float


class ClipReadMove(ClipMove):
    """A move as it was read; `confidence`: of its hold, in [0, 1]."""

    confidence: float


class ClipAttempt(BaseModel):
    """The attempt that was read in a clip, times in seconds; null: not seen.

    `holds`: of the route, the lowest first. `foreign`: share of the hands' holds that belong to
    other routes.
    """

    start_s: float | None
    top_s: float | None
    fall_s: float | None
    foreign: float
    holds: list[int]
    moves: list[ClipReadMove]


class ClipOut(BaseModel):
    """One's own clip.

    `state`: "receiving", "sent", "reading", "read" or "unreadable", then `fault` has the reason.
    `phase`: "wall" while the scan is loaded, "frames" while frames are read: `done` of `total`,
    "film" while the film is made.
    `scan_id`: the version of the wall that has the ids of the holds. `confirmed`: the sequence that
    one has confirmed. `has_film`: there is a film, `published_at`: since then the route shows it.
    """

    id: UUID
    route_id: UUID
    scan_id: UUID
    state: ClipState
    phase: str
    done: int
    total: int | None
    fault: str
    created_at: datetime
    attempt: ClipAttempt | None
    confirmed: list[ClipMove] | None
    has_film: bool
    published_at: datetime | None


class OwnClips(BaseModel):
    """One's latest clips, and the limits of the next one; `films`: one may publish films here."""

    max_mb: int
    max_seconds: int
    films: bool
    clips: list[ClipOut]


@router.get("/gyms/{gym}/clips")
def list_clips(
    session: Db,
    services: ServicesOf,
    access: ReaderMay,
    route: Annotated[UUID | None, Query(description="only those of a route")] = None,
) -> OwnClips:
    """Return one's own clips in a gym, the newest first."""
    rows = own_clips(session, access.gym.id, access.actor.known, route, _SHOWN)
    return OwnClips(
        max_mb=services.settings.max_clip_mb,
        max_seconds=MAX_SECONDS,
        films=may_publish(session, access.gym, access.actor.known, services.settings.features),
        clips=[_clip_out(row) for row in rows],
    )


class ConfirmedMove(Body):
    """The number of a move among those that were read, from 0, and its hold."""

    number: int = Field(ge=0, lt=_MAX_MOVES)
    hold: int = Field(ge=0, le=65535)


class ConfirmedMoves(Body):
    """The moves that one made; those that are left out were not made."""

    moves: list[ConfirmedMove] = Field(min_length=1, max_length=_MAX_MOVES)


@router.put("/gyms/{gym}/clips/{clip}/confirmed")
def confirm_own_clip(clip: UUID, body: ConfirmedMoves, session: Db, access: ClimberMay) -> ClipOut:
    """Confirm the sequence of one's own clip, corrected; it then counts at the route. An ascent is
    logged by its own request alone."""
    row = clip_of(session, access.gym.id, clip, access.actor.known)
    confirm_clip(row, [Correction(one.number, one.hold) for one in body.moves])
    return _clip_out(row)


@router.get("/gyms/{gym}/clips/{clip}/moves.json", response_class=JSONResponse)
def read_clip_moves(clip: UUID, session: Db, services: ServicesOf, access: ReaderMay) -> Response:
    """Return the moves of one's own clip, as `moves.json` of `walltopo`: the climber "clip", and
    those whom the model suggests for its route."""
    row = clip_of(session, access.gym.id, clip, access.actor.known)
    moves = replay_of(session, services.store, row)
    return Response(msgspec.json.encode(moves), media_type="application/json")


@router.delete("/gyms/{gym}/clips/{clip}", status_code=204)
def drop_clip(clip: UUID, session: Db, services: ServicesOf, access: ClimberMay) -> None:
    """Delete one's own clip with all that was read in it. The job deletes a video in the store."""
    row = clip_of(session, access.gym.id, clip, access.actor.known)
    session.delete(row)
    services.get(Incoming).beside("clips").drop(row.id)


class UsedRouteHold(BaseModel):
    """A hold of the published version. `number`: among the route's holds from the lowest on, null
    for others."""

    hold: int
    number: int | None
    climbers: int


class HandMove(BaseModel):
    """A hand takes a hold; `number` as in `UsedRouteHold`."""

    hand: Literal["left", "right"]
    hold: int
    number: int | None


class HandOrderOut(BaseModel):
    """An order of hands, and how many climbers used it."""

    moves: list[HandMove]
    climbers: int


class AttemptEnds(BaseModel):
    """A hold at which attempts ended; null: at the top."""

    hold: int | None
    number: int | None
    attempts: int


class RouteBetaOut(BaseModel):
    """How climbers climb a route, from their confirmed clips. With fewer than three climbers,
    `climbers` is null and all lists are empty."""

    climbers: int | None
    holds: list[UsedRouteHold]
    orders: list[HandOrderOut]
    ends: list[AttemptEnds]


@router.get("/gyms/{gym}/routes/{route}/beta")
def read_route_beta(
    route: UUID, session: Db, services: ServicesOf, access: GuestMay
) -> RouteBetaOut:
    """Return how climbers climb a route."""
    found = beta_of(session, services.store, route_of(session, access.gym.id, route))
    if found is None:
        return RouteBetaOut(climbers=None, holds=[], orders=[], ends=[])
    return _beta_out(found)


def _clip_out(row: Clip) -> ClipOut:
    attempt = attempt_in(row)
    return ClipOut(
        id=row.id,
        route_id=row.route_id,
        scan_id=row.scan_id,
        state=ClipState(row.state),
        phase=row.phase,
        done=row.done,
        total=row.total,
        fault=row.fault,
        created_at=row.created_at,
        attempt=None
        if attempt is None
        else ClipAttempt(
            start_s=attempt.start,
            top_s=attempt.top,
            fall_s=attempt.fall,
            foreign=attempt.foreign,
            holds=row.holds,
            moves=[ClipReadMove(**vars(move)) for move in moves_of(attempt)],
        ),
        confirmed=None if row.moves is None else [ClipMove(**move) for move in row.moves],
        has_film=row.film_size is not None,
        published_at=row.published_at,
    )


def _beta_out(found: RouteBeta) -> RouteBetaOut:
    numbers = {hold: number for number, hold in enumerate(found.holds, start=1)}

    def order_out(one: HandOrder) -> HandOrderOut:
        moves = [
            HandMove(hand=hand, hold=hold, number=numbers.get(hold)) for hand, hold in one.order
        ]
        return HandOrderOut(moves=moves, climbers=one.climbers)

    upwards = [*found.holds, *sorted(found.used.keys() - numbers.keys())]
    ends = [
        AttemptEnds(hold=hold, number=numbers.get(hold), attempts=count)
        for hold, count in sorted(found.ends.items(), key=lambda item: (-item[1], item[0]))
    ]
    tops = [AttemptEnds(hold=None, number=None, attempts=found.tops)] if found.tops else []
    return RouteBetaOut(
        climbers=found.climbers,
        holds=[
            UsedRouteHold(hold=hold, number=numbers.get(hold), climbers=found.used.get(hold, 0))
            for hold in upwards
        ],
        orders=[order_out(one) for one in found.orders],
        ends=[*tops, *ends],
    )

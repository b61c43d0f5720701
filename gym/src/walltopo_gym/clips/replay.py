"""The attempt of a clip as a climber of `moves.json`, beside those whom the model suggests."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

from sqlalchemy.orm import Session

from walltopo.scans.attempt import AttemptFile, FilmedMove
from walltopo.scans.moves import ClimberRow, MoveRow, Moves, RouteMoves
from walltopo_climb.movement.body import BODIES
from walltopo_climb.movement.sequence import LIMBS
from walltopo_gym.accounts.models import Profile
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.service import attempt_in, route_number
from walltopo_gym.errors import ConflictError, NotFoundError
from walltopo_gym.publishing.version_moves import suggested_climbers
from walltopo_gym.scans.models import Scan
from walltopo_gym.storage.files import FileStore

CLIMBER: Final = "clip"  # the viewer begins with it

Confirmed = Mapping[tuple[str, float], int]  # hold of a limb's move at a time


def replay_of(session: Session, store: FileStore, clip: Clip) -> Moves:
    """Return the moves of a clip's route: those of the clip, then the suggested ones.

    A confirmed clip moves as its person confirmed.

    Raises
    ------
    ConflictError : the clip is not read. NotFoundError : its version does not show the route.
    """
    attempt = attempt_in(clip)
    if attempt is None:
        raise ConflictError("clip-not-read")
    number = route_number(session, clip.route_id, clip.scan_id)
    if number is None:
        raise NotFoundError("not-there-route")
    height, span = _body_of(session.get(Profile, clip.person_id))
    own = ClimberRow(
        climber=CLIMBER,
        height=height,
        span=span,
        reached=attempt.top is not None,
        crux=0,
        moves=tuple(_shown_moves(attempt, clip)),
    )
    scan = session.get_one(Scan, clip.scan_id)
    suggested = suggested_climbers(store, scan, number)
    route = RouteMoves(number, (own, *suggested))
    return Moves(unit=attempt.unit, made_for=attempt.made_for, routes=(route,))


def _body_of(profile: Profile | None) -> tuple[float, float]:
    """Return the height and arm span of a profile in metres; those of an adult if it has none."""
    if profile is None or profile.height_cm is None:
        return BODIES["adult"].height, BODIES["adult"].span
    reach = profile.height_cm if profile.reach_cm is None else profile.reach_cm
    return profile.height_cm / 100, reach / 100


def _shown_moves(attempt: AttemptFile, clip: Clip) -> Iterator[MoveRow]:
    """Yield the moves until the top, as they were confirmed if they were.

    A limb whose move was not confirmed stays where it was until its next move or its release.
    """
    rows = clip.moves
    confirmed = (
        None if rows is None else {(row["limb"], row["time_s"]): row["hold"] for row in rows}
    )
    end = math.inf if attempt.top is None else attempt.top
    read, shown = [0] * len(LIMBS), [0] * len(LIMBS)
    for move in attempt.moves:
        if move.time > end:
            return
        for k, hold in enumerate(move.holds):
            if hold != read[k]:
                shown[k] = hold if _is_shown(move, k, confirmed) else shown[k]
                read[k] = hold
        if move.limb != "start":
            k = LIMBS.index(move.limb)
            key = move.limb, move.time
            if confirmed is not None and key not in confirmed:
                continue
            shown[k] = move.holds[k] if confirmed is None else confirmed[key]
        a, b, c, d = shown
        yield MoveRow(move.limb, (a, b, c, d), move.hip, move.effort, move.beyond)


def _is_shown(move: FilmedMove, limb: int, confirmed: Confirmed | None) -> bool:
    """Return whether a change of a limb's hold is a start, a release, or not to be confirmed."""
    return confirmed is None or move.limb == "start" or move.holds[limb] == 0

"""`moves.json`: how each route may be climbed, and about how hard it is."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Literal

import msgspec

from walltopo.scans.document import Coordinate, Count, Document, Label, Share
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route

Limb = Literal["start", "left hand", "right hand", "left foot", "right foot"]


class MoveRow(msgspec.Struct, frozen=True):
    """One limb goes to a hold.

    Parameters
    ----------
    limb : which; "start": how one begins.
    holds : hold ids of left hand, right hand, left foot, right foot afterwards; 0: on none.
    hip : world frame, when the limb arrives.
    effort : of holding on meanwhile; 1 is hanging with one hand on a jug.
    beyond : how far the hold is beyond reach, a leap; 0 where it is in reach; `beyond_m` in the
        file.
    """

    limb: Limb
    holds: tuple[Label, Label, Label, Label]
    hip: tuple[Coordinate, Coordinate, Coordinate]
    effort: Coordinate
    beyond: Coordinate = msgspec.field(name="beyond_m", default=0.0)


class ClimberRow(msgspec.Struct, frozen=True):
    """How a climber may go.

    Parameters
    ----------
    climber : child, short, adult, tall, or "you" for one whose height was given.
    height, span : metres; `height_m` and `span_m` in the file.
    reached : whether the top is reached; else the moves end where both hands are highest.
    crux : index of the hardest move of a hand.
    moves : empty where not even the start is in reach.
    """

    climber: str
    height: Coordinate = msgspec.field(name="height_m")
    span: Coordinate = msgspec.field(name="span_m")
    reached: bool
    crux: Count
    moves: tuple[MoveRow, ...]


class GradeRow(msgspec.Struct, frozen=True):
    """A range of Font grades, from `low` to `high`.

    Parameters
    ----------
    coverage : share of climbs whose grade is in such a range.
    graded : how many grades of this gym it leans on; 0: on those of a standard board alone.
    """

    low: str
    high: str
    coverage: Share
    graded: Count = 0


class RouteMoves(msgspec.Struct, frozen=True):
    """One route."""

    route: Label
    climbers: tuple[ClimberRow, ...]
    grade: GradeRow | None = None


class Moves(Document, frozen=True, kw_only=True):
    """`moves.json`; lengths of bodies are metres, places are in the scan's units.

    Parameters
    ----------
    unit : how many units of the scan a metre is: 1 where it has a scale.
    made_for : `moves_basis` of the holds and routes that the moves were found on.
    """

    unit: Coordinate = 1.0
    made_for: str = ""
    routes: tuple[RouteMoves, ...]


def moves_basis(holds: Iterable[HoldRow], routes: Iterable[Route]) -> str:
    """Return a hash of what moves and grades depend on: moves of another hash are stale."""
    basis = (
        [(h.id, h.kind, h.type, h.role, h.position, h.normal, h.size) for h in holds],
        [(r.id, r.holds, r.start, r.top, r.footholds, r.grade) for r in routes],
    )
    return hashlib.blake2b(msgspec.json.encode(basis), digest_size=16).hexdigest()

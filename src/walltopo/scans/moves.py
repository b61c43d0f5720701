"""`moves.json`: the likely moves of each route, and its grade range."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Literal

import msgspec

from walltopo.scans.document import Coordinate, Count, Document, Label, Share
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route

Limb = Literal["start", "left hand", "right hand", "left foot", "right foot"]


class MoveRow(msgspec.Struct, frozen=True):
    """The move of one limb to a hold.

    Parameters
    ----------
    limb : the moving limb; "start" for the start.
    holds : hold ids of left hand, right hand, left foot, right foot afterwards; 0: on none.
    hip : world frame, when the limb arrives.
    effort : of holding on during the move; 1 is hanging with one hand on a jug.
    beyond : distance of the hold beyond reach, a leap; 0 if in reach; `beyond_m` in the file.
    """

    limb: Limb
    holds: tuple[Label, Label, Label, Label]
    hip: tuple[Coordinate, Coordinate, Coordinate]
    effort: Coordinate
    beyond: Coordinate = msgspec.field(name="beyond_m", default=0.0)


class ClimberRow(msgspec.Struct, frozen=True):
    """The likely moves of one climber.

    Parameters
    ----------
    climber : child, short, adult, tall, or "you" for a given height.
    height, span : metres; `height_m` and `span_m` in the file.
    reached : whether the top is reached; else the moves end where both hands are highest.
    crux : index of the hardest hand move.
    moves : empty if even the start is out of reach.
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
    graded : number of this gym's grades behind the range; 0: only those of a standard board.
    """

    low: str
    high: str
    coverage: Share
    graded: Count = 0


class RouteMoves(msgspec.Struct, frozen=True):
    """The moves and the grade of one route."""

    route: Label
    climbers: tuple[ClimberRow, ...]
    grade: GradeRow | None = None


class Moves(Document, frozen=True, kw_only=True):
    """`moves.json`; lengths of bodies are metres, positions are in the scan's units.

    Parameters
    ----------
    unit : scan units per metre: 1 if the scan has a scale.
    made_for : `moves_basis` of the holds and routes of these moves.
    """

    unit: Coordinate = 1.0
    made_for: str = ""
    routes: tuple[RouteMoves, ...]


def moves_basis(holds: Iterable[Hold], routes: Iterable[Route]) -> str:
    """Return a hash of the inputs of moves and grades: moves with another hash are stale."""
    basis = (
        [(h.id, h.kind, h.type, h.role, h.position, h.normal, h.size) for h in holds],
        [(r.id, r.holds, r.start, r.top, r.footholds, r.grade) for r in routes],
    )
    return hashlib.blake2b(msgspec.json.encode(basis), digest_size=16).hexdigest()

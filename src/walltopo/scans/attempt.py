"""`attempt.json`: the holds that a climber used in a clip, and how far the climber came."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from walltopo.scans.document import Coordinate, Document, Label, Share
from walltopo.scans.moves import MoveRow

Seconds = Annotated[float, msgspec.Meta(ge=0, le=86400)]
MovingLimb = Literal["left hand", "right hand", "left foot", "right foot"]


class ContactRow(msgspec.Struct, frozen=True):
    """A limb on a hold.

    Parameters
    ----------
    hold : its id; 0: the bare wall or a volume's plain side.
    begin, end : time in the clip; `begin_s` and `end_s` in the file.
    confidence : of this hold against the next best explanation.
    """

    limb: MovingLimb
    hold: Label
    begin: Seconds = msgspec.field(name="begin_s")
    end: Seconds = msgspec.field(name="end_s")
    confidence: Share


class FilmedMove(MoveRow, frozen=True, kw_only=True):
    """A move of the attempt, as those of `moves.json`, with its times.

    Parameters
    ----------
    came_from : hold of the limb before, 0: none.
    time : when the limb arrives; `time_s` in the file.
    duration : since the move before; `duration_s` in the file.
    confidence : of the hold that the limb arrives at.
    """

    came_from: Label
    time: Seconds = msgspec.field(name="time_s")
    duration: Seconds = msgspec.field(name="duration_s")
    confidence: Share


class Rest(msgspec.Struct, frozen=True):
    """A time without a hand's move; `begin_s` and `end_s` in the file."""

    begin: Seconds = msgspec.field(name="begin_s")
    end: Seconds = msgspec.field(name="end_s")


class AttemptFile(Document, frozen=True, kw_only=True):
    """`attempt.json`; positions are in the frame and unit of the scan.

    Parameters
    ----------
    clip : file name of the clip. length : of the clip; `length_s` in the file.
    made_for : `moves_basis` of the holds and routes of the wall.
    route : id of the route, None if no route fits. foreign : share of the hands' contacts with
        holds of other routes.
    start, top, fall : times, `start_s` and so on in the file; None: not seen in the clip.
    highest : id of the highest hold that a hand held, 0: none.
    """

    clip: str
    length: Seconds = msgspec.field(name="length_s")
    unit: Coordinate = 1.0
    made_for: str = ""
    route: Label | None
    foreign: Share
    start: Seconds | None = msgspec.field(name="start_s")
    top: Seconds | None = msgspec.field(name="top_s")
    fall: Seconds | None = msgspec.field(name="fall_s")
    highest: Label
    moves: tuple[FilmedMove, ...]
    rests: tuple[Rest, ...]
    contacts: tuple[ContactRow, ...]

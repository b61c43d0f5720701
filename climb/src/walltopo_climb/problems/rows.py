"""Messages with proposals, for programs and pages."""

from __future__ import annotations

from typing import Literal

import msgspec

from walltopo.scans.document import Coordinate, Count, Label, Share
from walltopo.scans.moves import ClimberRow, GradeRow

Do = Literal["add a foothold", "add a handhold", "take away"]


class Proposal(msgspec.Struct, frozen=True):
    """A proposed problem.

    Parameters
    ----------
    hands : hold ids from the start to the top; start, top : among them; feet : for feet only.
    grade : the range.
    moves : number of hand moves of an adult.
    violations : parts of the specification that the problem does not meet: grade, moves,
        steepness, holds, reach, body; "easy": the model knows no easier problem, and the range is
        open below. `misses` in JSON.
    alike : share of common holds with the most similar other proposal.
    climbers : moves of bodies of several heights.
    """

    hands: tuple[Label, ...]
    start: tuple[Label, ...]
    top: tuple[Label, ...]
    feet: tuple[Label, ...]
    grade: GradeRow
    moves: Count
    violations: tuple[str, ...] = msgspec.field(name="misses")
    alike: Share
    climbers: tuple[ClimberRow, ...]


class Proposals(msgspec.Struct, frozen=True):
    """The response to a specification.

    Parameters
    ----------
    unit : scan units per metre.
    tried : number of problems that were scored.
    proposals : best first; fewer than requested if no more were found that differ.
    """

    unit: Coordinate
    tried: Count
    proposals: tuple[Proposal, ...]
    version: int = 1


class Tweak(msgspec.Struct, frozen=True):
    """The addition or removal of one hold, which changes the grade of a route.

    Parameters
    ----------
    do : the change. hold : its id; on : id of another route of the hold, 0: none.
    by : grades, below 0 easier: difference of the model's estimates before and after.
    grade : the range afterwards.
    crux : target hold id of the hardest move, before; eases : share of effort that the hardest
        move saves, below 0 more. The hardest move afterwards may be another one.
    climbers : moves of bodies of several heights afterwards.
    """

    do: Do
    hold: Label
    on: Label
    by: Coordinate
    grade: GradeRow
    crux: Label
    eases: Coordinate
    climbers: tuple[ClimberRow, ...]


class Tweaks(msgspec.Struct, frozen=True):
    """The changes that make a route about one grade easier, or harder.

    Parameters
    ----------
    route : its id. grade : its range now. tweaks : nearest to one grade first.
    """

    unit: Coordinate
    route: Label
    grade: GradeRow
    tried: Count
    tweaks: tuple[Tweak, ...]
    version: int = 1

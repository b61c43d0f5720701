"""What is proposed, as programs and pages read it."""

from __future__ import annotations

from typing import Literal

import msgspec

from walltopo.scans.document import Coordinate, Count, Label, Share
from walltopo.scans.moves import ClimberRow, GradeRow

Do = Literal["add a foothold", "add a handhold", "take away"]


class Proposal(msgspec.Struct, frozen=True):
    """A problem.

    Parameters
    ----------
    hands : hold ids from the start to the top; start, top : those of them; feet : for feet alone.
    grade : the range.
    moves : of hands, an adult's.
    misses : what was wished for and it has not: grade, moves, steepness, holds, reach, body;
        "easy": the model knows nothing so easy, and the range says so.
    alike : share of the holds that it has in common with the proposal that is most like it.
    climbers : how bodies of several heights may go.
    """

    hands: tuple[Label, ...]
    start: tuple[Label, ...]
    top: tuple[Label, ...]
    feet: tuple[Label, ...]
    grade: GradeRow
    moves: Count
    misses: tuple[str, ...]
    alike: Share
    climbers: tuple[ClimberRow, ...]


class Proposals(msgspec.Struct, frozen=True):
    """The answer to a wish.

    Parameters
    ----------
    unit : how many units of the scan a metre is.
    tried : problems that were judged.
    proposals : the best first; fewer than wished where no more were found that differ.
    """

    unit: Coordinate
    tried: Count
    proposals: tuple[Proposal, ...]
    version: int = 1


class Tweak(msgspec.Struct, frozen=True):
    """One hold that changes how hard a route is.

    Parameters
    ----------
    do : what with it. hold : its id; on : id of another route that it is on, 0: on none.
    by : grades, below 0 easier; between what the model says before and after.
    grade : the range afterwards.
    crux : hold id that the hardest move goes to, before; eases : how much less effort that move
        takes, as a share; below 0 more. The hardest move afterwards may be another one.
    climbers : how bodies of several heights may go afterwards.
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
    """What makes a route about one grade easier, or harder.

    Parameters
    ----------
    route : its id. grade : its range now. tweaks : the nearest to one grade first.
    """

    unit: Coordinate
    route: Label
    grade: GradeRow
    tried: Count
    tweaks: tuple[Tweak, ...]
    version: int = 1

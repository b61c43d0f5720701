"""A proposal on the wall: entries of the log of edits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from walltopo.scans.edits import Edit, Leave, Ref, RoleName, SetProblem, SetRole, Share
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route
from walltopo_climb.problems.rows import Proposal, Tweak


def as_problem(proposal: Proposal, holds: Mapping[int, HoldRow]) -> SetProblem:
    """The entry that makes a proposal a route, marked as proposed."""

    def refs(numbers: Iterable[int]) -> tuple[Ref, ...]:
        return tuple(_ref(holds[number]) for number in numbers)

    return SetProblem(
        hands=refs(proposal.hands),
        start=refs(proposal.start),
        top=refs(proposal.top),
        feet=refs(proposal.feet),
        new=0,
        proposed=True,
    )


def as_tweak(tweak: Tweak, route: Route, holds: Mapping[int, HoldRow]) -> tuple[Edit, ...]:
    """The entries that add a hold to a route, or take it away; other routes keep it."""
    hold, to = _ref(holds[tweak.hold]), Ref(route.id, holds[route.holds[0]].position)
    if tweak.do == "take away":
        return (Leave(hold=hold, route=to),)
    role: RoleName = "foot" if tweak.do == "add a foothold" else "hand"
    return Share(hold=hold, route=to), SetRole(hold=hold, route=to, role=role)


def _ref(hold: HoldRow) -> Ref:
    return Ref(hold.id, hold.position)

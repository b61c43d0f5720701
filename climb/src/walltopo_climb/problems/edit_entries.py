"""Convert proposals to entries of the log of edits."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from walltopo.scans.edits import Edit, Leave, Ref, RoleName, SetProblem, SetRole, Share
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.problems.rows import Proposal, Tweak


def problem_entry(proposal: Proposal, holds: Mapping[int, Hold]) -> SetProblem:
    """Return the entry that makes a proposal a route, marked as proposed."""

    def refs(numbers: Iterable[int]) -> tuple[Ref, ...]:
        return tuple(_hold_ref(holds[number]) for number in numbers)

    return SetProblem(
        hands=refs(proposal.hands),
        start=refs(proposal.start),
        top=refs(proposal.top),
        feet=refs(proposal.feet),
        new=0,
        proposed=True,
    )


def tweak_entries(tweak: Tweak, route: Route, holds: Mapping[int, Hold]) -> tuple[Edit, ...]:
    """Return the entries that add a hold to a route, or remove it; its other routes keep it."""
    hold, to = _hold_ref(holds[tweak.hold]), Ref(route.id, holds[route.holds[0]].position)
    if tweak.do == "take away":
        return (Leave(hold=hold, route=to),)
    role: RoleName = "foot" if tweak.do == "add a foothold" else "hand"
    return Share(hold=hold, route=to), SetRole(hold=hold, route=to, role=role)


def _hold_ref(hold: Hold) -> Ref:
    return Ref(hold.id, hold.position)

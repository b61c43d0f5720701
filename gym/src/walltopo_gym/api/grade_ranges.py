"""Ranges of grades for the routes of a scan in review: beside the setter's grade, never instead."""

from __future__ import annotations

from typing import Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_climb.grades.font import FONT, V_OF
from walltopo_climb.grades.model import Range
from walltopo_gym.api.routes import PublisherMay
from walltopo_gym.api.scans import scan_of
from walltopo_gym.api.services import Db
from walltopo_gym.grading.ranges import Odd, ranges_of
from walltopo_gym.scans.states import check_in_review

router = APIRouter(tags=["publishing"])


class Ends(BaseModel):
    """The easiest and the hardest grade of a range, both included, on two scales."""

    low: str
    high: str
    low_v: str
    high_v: str

    @classmethod
    def of(cls, found: Range) -> Ends:
        """As the model says it."""
        low, high = found.low, found.high
        return cls(low=FONT[low], high=FONT[high], low_v=f"V{V_OF[low]}", high_v=f"V{V_OF[high]}")


class OddFacts(Ends):
    """A route whose grade lies outside of the range that its movement and the gym's other grades
    say: "soft" where the grade is above, "hard" where it is below, `by` steps of the Font scale."""

    route_id: UUID
    side: Literal["soft", "hard"]
    by: int

    @classmethod
    def told(cls, odd: Odd) -> OddFacts:
        """As the platform found it."""
        ends = Ends.of(odd.range).model_dump()
        return cls(route_id=odd.route, side=odd.side, by=odd.by, **ends)


class GradeRange(Ends):
    """Of the route with this number in the scan."""

    number: int


class GradeRanges(BaseModel):
    """About how hard the routes of a scan are, as if each were new to the gym.

    `state`: "waiting" while they are worked out. `graded`: routes of the gym that they lean on, 0:
    on the problems of a board alone; `voted`: those of them that count by climbers' votes.
    `coverage`: share of routes whose grade is in such a range. Routes that the model finds no way
    up have none.
    """

    state: Literal["waiting", "ready"]
    graded: int
    voted: int
    coverage: float
    routes: list[GradeRange]


@router.get("/gyms/{gym}/scans/{scan}/grade-ranges")
def read_grade_ranges(scan: UUID, session: Db, access: PublisherMay) -> GradeRanges:
    """About how hard the routes of a scan in review are: ranges, from their movement."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    found = ranges_of(session, access.gym.id, row.id)
    if found is None:
        return GradeRanges(state="waiting", graded=0, voted=0, coverage=0.0, routes=[])
    routes = [
        GradeRange(number=number, **Ends.of(one).model_dump())
        for number, one in sorted(found.found.items())
    ]
    return GradeRanges(state="ready", graded=found.graded, voted=found.voted,
                       coverage=found.coverage, routes=routes)  # fmt: skip

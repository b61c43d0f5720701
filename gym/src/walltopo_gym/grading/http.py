"""Endpoints of a scan in review: grade ranges, shown beside the setter's grade, and the reach."""

from __future__ import annotations

from typing import Final, Literal
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel

from walltopo_climb.movement.reach import ARMS, HEIGHTS, Reached
from walltopo_gym.api.grades import GradeBounds
from walltopo_gym.api.services import Db
from walltopo_gym.grading.service import ranges_of, reach_of
from walltopo_gym.gyms.access import PublisherMay
from walltopo_gym.scans.service import check_in_review, scan_of

router = APIRouter(tags=["publishing"])


class GradeRange(GradeBounds):
    """The range of the route with this number in the scan."""

    number: int


class GradeRanges(BaseModel):
    """Estimated ranges of a scan's routes, as if each were new to the gym.

    `state`: "waiting" while they are computed. `graded`: number of the gym's routes that they are
    based on, 0: on the problems of a training board alone; `voted`: those of them that count by
    climbers' votes. `coverage`: share of routes whose grade is in such a range. Routes without a
    feasible sequence have no range.
    """

    state: Literal["waiting", "ready"]
    graded: int
    voted: int
    coverage: float
    routes: list[GradeRange]


class RouteReach(BaseModel):
    """The route with this number in the scan: for each of the heights, whether climbers of it reach
    the top. `depends`: by their arm span."""

    number: int
    reached: list[Reached]


class ScanReach(BaseModel):
    """The heights of climbers that reach the tops of a scan's routes, by the movement model.

    `state`: "waiting" while it is computed. `heights`: in metres. `arms`: the share by which arm
    spans were taken longer and shorter than the height. Routes without start or top have no row.
    """

    state: Literal["waiting", "ready"]
    heights: list[float]
    arms: float
    routes: list[RouteReach]


@router.get("/gyms/{gym}/scans/{scan}/grade-ranges")
def read_grade_ranges(scan: UUID, session: Db, access: PublisherMay) -> GradeRanges:
    """Return estimated grade ranges of the routes of a scan in review."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    found = ranges_of(session, access.gym.id, row.id)
    if found is None:
        return GradeRanges(state="waiting", graded=0, voted=0, coverage=0.0, routes=[])
    routes = [
        GradeRange(number=number, **GradeBounds.of(one).model_dump())
        for number, one in sorted(found.found.items())
    ]
    return GradeRanges(
        state="ready",
        graded=found.graded,
        voted=found.voted,
        coverage=found.coverage,
        routes=routes,
    )


@router.get("/gyms/{gym}/scans/{scan}/reach")
def read_scan_reach(scan: UUID, session: Db, access: PublisherMay) -> ScanReach:
    """Return which heights reach the top of each route of a scan in review."""
    row = scan_of(session, access.gym.id, scan)
    check_in_review(row.state)
    reach = reach_of(session, row.id)
    found = sorted((int(number), reached) for number, reached in (reach or {}).items())
    return ScanReach(
        state="waiting" if reach is None else "ready",
        heights=list(HEIGHTS),
        arms=ARMS,
        routes=[RouteReach(number=number, reached=reached) for number, reached in found],
    )


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

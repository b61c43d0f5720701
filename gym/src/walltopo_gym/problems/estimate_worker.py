"""The process that estimates problems: `python -m walltopo_gym.problems.estimate_worker`.

The movement model's search grows fast with the holds of a problem, so it runs where it can be
killed. A request a line on stdin, an answer a line on stdout; the process ends when stdin does.
"""

from __future__ import annotations

import os
import sys
from typing import Literal

import msgspec

from walltopo.scans.holds import Hold
from walltopo.scans.moves import ClimberRow
from walltopo.scans.routes import Route
from walltopo_climb.grades.model import shipped_model
from walltopo_climb.grades.of_scan import rate_routes
from walltopo_climb.movement.body import BODIES
from walltopo_climb.movement.reach import reaching_heights
from walltopo_climb.movement.rows import climber_rows
from walltopo_climb.problems.openings import Opening, find_openings
from walltopo_climb.problems.pool import Pool


class EstimateRequest(msgspec.Struct, frozen=True):
    """A problem as a route of its wall, the wall's holds, and scan units per metre.

    `task`: its grade and who reaches the top, the moves of several bodies, or holds that open it to
    shorter climbers.
    """

    route: Route
    holds: list[Hold]
    unit: float
    task: Literal["estimate", "moves", "openings"] = "estimate"


class ProblemEstimate(msgspec.Struct, frozen=True):
    """The estimate of a problem.

    Parameters
    ----------
    difficulty : on the grade model's scale; None if an adult finds no moves.
    known : whether enough of its holds have a type.
    heights : of climbers who reach the top, in metres.
    """

    difficulty: float | None
    known: bool
    heights: tuple[float, ...]


def estimate_problem(request: EstimateRequest) -> ProblemEstimate:
    """Return the estimate of a problem."""
    found = rate_routes([request.route], request.holds, request.unit, shipped_model())
    heights = tuple(reaching_heights(request.route, request.holds, request.unit) or ())
    if not found:
        return ProblemEstimate(None, known=False, heights=heights)
    return ProblemEstimate(found[0].difficulty, found[0].known, heights)


def work_on(request: EstimateRequest) -> ProblemEstimate | tuple[ClimberRow | Opening, ...]:
    """Return the answer to a request, of the kind that its task has."""
    if request.task == "moves":
        return climber_rows(request.route, request.holds, request.unit, BODIES)
    if request.task == "openings":
        return find_openings(Pool.of(request.holds, request.unit, False), request.route)
    return estimate_problem(request)


# A climb with moves compiles or loads every kernel, before the time of the first request runs. A
# kernel that a request had to compile would outlast its time, and never reach the disk.
_FIRST = EstimateRequest(
    Route(id=1, holds=tuple(range(1, 9)), start=(2,), top=(8,)),
    [
        Hold(id=n, kind="hold", position=(0.3 * (n % 2), 0.0, 0.4 * n), size=0.1)
        for n in range(1, 9)
    ],
    1.0,
)


def main() -> None:
    """Answer requests until stdin ends."""
    out = os.fdopen(os.dup(1), "wb", buffering=0)
    os.dup2(2, 1)  # what libraries print goes to the operator's log
    out.write(msgspec.json.encode(estimate_problem(_FIRST)) + b"\n")
    for line in sys.stdin.buffer:
        request = msgspec.json.decode(line, type=EstimateRequest)
        out.write(msgspec.json.encode(work_on(request)) + b"\n")


if __name__ == "__main__":
    main()

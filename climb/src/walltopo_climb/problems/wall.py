"""A wall on which problems are set."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from walltopo.core import InputError
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route
from walltopo_climb.grades.model import shipped_model
from walltopo_climb.grades.of_scan import Scale, rate_routes
from walltopo_climb.problems.adjust_grade import Direction, adjust_grade
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposals, Tweaks
from walltopo_climb.problems.search import propose
from walltopo_climb.problems.spec import ProblemSpec


@dataclass(frozen=True)
class SetWall:
    """The holds and routes of a scan, on which problems are set."""

    pool: Pool
    routes: tuple[Route, ...]

    @classmethod
    def build(
        cls, holds: Sequence[Hold], routes: Sequence[Route], unit: float, floor_known: bool
    ) -> SetWall:
        """Build the wall; `unit`: scan units per metre; `floor_known`: z = 0 is the floor."""
        return cls(Pool.of(holds, unit, floor_known), tuple(routes))

    def propose(self, spec: ProblemSpec) -> Proposals:
        """Return problems by `propose`, on the scale of the wall's graded routes."""
        return propose(self.pool, spec, self._grade_scale())

    def adjust_grade(self, route: int, direction: Direction) -> Tweaks:
        """Return changes by `adjust_grade`; raise InputError if the route does not exist."""
        return adjust_grade(
            self.pool, self.route(route), self.routes, self._grade_scale(route), direction
        )

    def route(self, number: int) -> Route:
        """Return the route with this number; raise InputError if it does not exist."""
        found = next((one for one in self.routes if one.id == number), None)
        if found is None:
            known = ", ".join(str(one.id) for one in self.routes) or "none"
            raise InputError(f"route {number} does not exist", f"The routes are: {known}.")
        return found

    def _grade_scale(self, without: int = 0) -> Scale:
        model = shipped_model()
        graded = rate_routes(self.routes, self.pool.rows, self.pool.unit, model)
        return Scale.of(graded, model, without)

"""A wall that problems are set on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from walltopo.core import InputError
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route
from walltopo_climb.grades.model import shipped_model
from walltopo_climb.grades.of_scan import Scale, place_routes
from walltopo_climb.problems.ease import Way, ease
from walltopo_climb.problems.pool import Pool
from walltopo_climb.problems.rows import Proposals, Tweaks
from walltopo_climb.problems.search import propose
from walltopo_climb.problems.wish import Wish


@dataclass(frozen=True)
class SetWall:
    """Holds and routes of a scan."""

    pool: Pool
    routes: tuple[Route, ...]

    @classmethod
    def of(
        cls, holds: Sequence[HoldRow], routes: Sequence[Route], unit: float, floor_known: bool
    ) -> SetWall:
        """`unit`: of the scan, a metre. `floor_known`: whether z = 0 is the floor."""
        return cls(Pool.of(holds, unit, floor_known), tuple(routes))

    def propose(self, wish: Wish) -> Proposals:
        """Problems, see `propose`; on the scale that the wall's graded routes tell."""
        return propose(self.pool, wish, self._scale())

    def ease(self, route: int, way: Way) -> Tweaks:
        """One grade easier or harder, see `ease`. InputError where there is no such route."""
        return ease(self.pool, self.route(route), self.routes, self._scale(route), way)

    def route(self, number: int) -> Route:
        """The route with this number."""
        found = next((one for one in self.routes if one.id == number), None)
        if found is None:
            known = ", ".join(str(one.id) for one in self.routes) or "none"
            raise InputError(f"there is no route {number}", f"There are: {known}.")
        return found

    def _scale(self, without: int = 0) -> Scale:
        model = shipped_model()
        graded = place_routes(self.routes, self.pool.rows, self.pool.unit, model)
        return Scale.of(graded, model, without)

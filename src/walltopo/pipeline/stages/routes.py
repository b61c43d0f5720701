"""Run the stage `routes`: group holds into routes."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.describe.settings import RoutesSettings
from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.manifest import Metrics
from walltopo.scans.routes import Routes


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    mesh: Mesh = of(ScanFolder.mesh)
    holds_raw: Holds = of(ScanFolder.holds_raw)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    routes_raw: Routes = of(ScanFolder.routes_raw)
    metrics: Metrics = figures()


def run(reads: Reads, settings: RoutesSettings, context: Context) -> Writes:
    """Group holds into routes."""
    from walltopo.describe.routes.find import find_routes

    holds = reads.holds_raw.holds
    routes, unrouted = find_routes(
        reads.mesh,
        holds,
        settings,
        unit=reads.holds_raw.unit,
        left_out=reads.holds_raw.left_out,
        progress=context.progress,
    )
    volumes = sorted(hold.id for hold in holds if hold.role == "volume")
    return Writes(
        Routes(routes=tuple(routes), unrouted=tuple(unrouted), volumes=tuple(volumes)),
        {
            "routes": len(routes),
            "holds_in_routes": sum(len(route.holds) for route in routes),
            "unrouted": len(unrouted),
            "ambiguous": sum(len(route.ambiguous) for route in routes),
            "volumes": len(volumes),
        },
    )


ROUTES = Stage("routes", Reads, Writes, run, version=7, cost=Cost(0.2, 0.126))

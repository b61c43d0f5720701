"""The stage `routes`: holds to routes."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import Mesh
from walltopo.describe.routes.settings import RoutesSettings
from walltopo.pipeline.stage import Stage
from walltopo.scans.artifacts import figures, of
from walltopo.scans.attributes import RawAttributes
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.routes import Routes


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    mesh: Mesh = of(ScanFolder.mesh)
    attributes_raw: RawAttributes = of(ScanFolder.attributes_raw)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    routes_raw: Routes = of(ScanFolder.routes_raw)
    metrics: Metrics = figures()


def run(reads: Reads, settings: RoutesSettings, context: Context) -> Writes:
    """Holds to routes."""
    from walltopo.describe.routes.find import find_routes

    holds = reads.attributes_raw.instances
    routes, unrouted = find_routes(
        reads.mesh,
        holds,
        settings,
        unit=reads.attributes_raw.unit,
        left_out=reads.attributes_raw.left_out,
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


ROUTES = Stage("routes", Reads, Writes, run, version=6)

"""Run the stage `edit`: replay a setter's edits on the output of `classify` and `routes`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.editing.settings import EditSettings
from walltopo.editing.snapshot import SnapshotFiles
from walltopo.pipeline.stage import Cost, Stage
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.folder import ScanFolder
from walltopo.scans.hidden import HiddenPlaces
from walltopo.scans.holds import Holds
from walltopo.scans.instances import Relabelled
from walltopo.scans.manifest import Metrics
from walltopo.scans.routes import Routes


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    routes: Routes = of(ScanFolder.routes)
    holds: Holds = of(ScanFolder.holds)
    relabelled: Relabelled | None = of(ScanFolder.relabelled)
    hidden: HiddenPlaces | None = of(ScanFolder.hidden)
    metrics: Metrics = figures()


def run(reads: SnapshotFiles, settings: EditSettings, context: Context) -> Writes:
    """Replay the edit log on the output of `classify` and `routes`.

    Metrics: edits, edits without a target, hidden places; holds, volumes, instances left out;
    routes, holds in a route, holds without a route, ambiguous holds, routes with a low-confidence
    start or top.

    Raises
    ------
    InputError : files of earlier stages are inconsistent.
    """
    from walltopo.editing.replay import replay
    from walltopo.editing.snapshot import ScanSnapshot

    log = reads.log
    snapshot = ScanSnapshot.of(reads, settings)
    outcome = replay(snapshot, log.edits)
    for note in outcome.notes:
        context.progress.note(note.text)
    holds, routes = outcome.holds.holds, outcome.routes.routes
    volumes = sum(hold.kind == "volume" for hold in holds)
    return Writes(
        routes=outcome.routes,
        holds=outcome.holds,
        relabelled=Relabelled.between(snapshot.labels, outcome.labels),
        hidden=HiddenPlaces(places=outcome.hidden) if outcome.hidden else None,
        metrics={
            "edits": len(log.edits),
            "lost": len(outcome.notes),
            "hidden": len(outcome.hidden),
            "holds": len(holds) - volumes,
            "volumes": volumes,
            "left_out": len(outcome.holds.left_out),
            "routes": len(routes),
            "holds_in_routes": sum(len(route.holds) for route in routes),
            "unrouted": len(outcome.routes.unrouted),
            "ambiguous": sum(len(route.ambiguous) for route in routes),
            "doubtful": sum(bool(r.doubtful_start or r.doubtful_top) for r in routes),
        },
    )


EDIT = Stage("edit", SnapshotFiles, Writes, run, version=3, cost=Cost(0.4, 0.01))

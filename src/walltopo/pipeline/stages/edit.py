"""The stage `edit`: replay a setter's corrections on what `classify` and `routes` found."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.editing.settings import EditSettings
from walltopo.editing.snapshot import SnapshotFiles
from walltopo.pipeline.stage import Stage
from walltopo.scans.artifacts import figures, of
from walltopo.scans.attributes import Attributes
from walltopo.scans.context import Context
from walltopo.scans.edits import EditLog
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Holds
from walltopo.scans.instances import Relabelled
from walltopo.scans.manifest import Metrics
from walltopo.scans.routes import Routes


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    attributes: Attributes = of(ScanFolder.attributes)
    routes: Routes = of(ScanFolder.routes)
    holds: Holds = of(ScanFolder.holds)
    relabelled: Relabelled | None = of(ScanFolder.relabelled)
    metrics: Metrics = figures()


def run(reads: SnapshotFiles, settings: EditSettings, context: Context) -> Writes:
    """Replay the log on what `classify` and `routes` found.

    Metrics: entries of the log, those that found nothing; holds, volumes, instances left out;
    routes, holds in a route, holds without one, ambiguous holds, routes with a doubtful start or
    top.

    Raises
    ------
    InputError : files of earlier stages do not fit each other.
    """
    from walltopo.editing.replay import replay
    from walltopo.editing.snapshot import ScanSnapshot

    log = reads.edits or EditLog()
    scanned = ScanSnapshot.of(reads, settings)
    outcome = replay(scanned, log.edits)
    for note in outcome.notes:
        context.progress.note(note.text)
    holds, routes = outcome.attributes.instances, outcome.routes.routes
    volumes = sum(hold.kind == "volume" for hold in holds)
    return Writes(
        attributes=outcome.attributes,
        routes=outcome.routes,
        holds=outcome.holds,
        relabelled=Relabelled.between(scanned.labels, outcome.labels),
        metrics={
            "edits": len(log.edits),
            "lost": len(outcome.notes),
            "holds": len(holds) - volumes,
            "volumes": volumes,
            "left_out": len(outcome.left_out),
            "routes": len(routes),
            "holds_in_routes": sum(len(route.holds) for route in routes),
            "unrouted": len(outcome.routes.unrouted),
            "ambiguous": sum(len(route.ambiguous) for route in routes),
            "doubtful": sum(bool(r.doubtful_start or r.doubtful_top) for r in routes),
        },
    )


EDIT = Stage("edit", SnapshotFiles, Writes, run, version=2)

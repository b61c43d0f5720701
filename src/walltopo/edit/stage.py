"""The `edit` stage: the holds and routes of a scan, with a setter's corrections."""

from __future__ import annotations

from walltopo.core import Progress
from walltopo.edit.board import Scanned
from walltopo.edit.contract import EditSettings, Reads, Writes
from walltopo.edit.replay import replay
from walltopo.scans.context import Context
from walltopo.scans.edits import EditLog
from walltopo.scans.old_edits import HoldEdits, RouteEdits, as_log
from walltopo.scans.relabelled import Relabelled

__all__ = ["log_of", "run"]


def log_of(
    edits: EditLog | None, holds: HoldEdits, routes: RouteEdits, progress: Progress
) -> EditLog:
    """The log that counts: `edits.json`, else what the two files before it say."""
    old = as_log(holds, routes)
    if edits is None:
        return old
    if old.edits:
        progress.note(
            "holds.edits.json and routes.edits.toml are not read any more: edits.json is there"
        )
    return edits


def run(reads: Reads, settings: EditSettings, context: Context) -> Writes:
    """Replay the log on what `classify` and `routes` found.

    Metrics: entries of the log, those that found nothing; holds, volumes, instances left out;
    routes, holds in a route, holds without one, ambiguous holds, routes with a doubtful start or
    top.

    Raises
    ------
    InputError : files of earlier stages do not fit each other.
    """
    log = log_of(reads.edits, reads.hold_edits, reads.route_edits, context.progress)
    scanned = Scanned.of(reads, settings)
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

"""Run the stage `export`: the viewer page, glTF and report of a finished scan."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Cost, Stage
from walltopo.publish.settings import ExportSettings
from walltopo.publish.wall_files import PageFiles
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.moves import moves_basis
from walltopo.scans.pictures import Made


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    glb: Made = of(ScanFolder.glb)
    page_assets: Made = of(ScanFolder.page_assets)
    page: Made = of(ScanFolder.page)
    report: Made = of(ScanFolder.report)
    metrics: Metrics = figures()


def run(reads: PageFiles, settings: ExportSettings, context: Context) -> Writes:
    """Write `wall.glb`, the page with its assets, and the report.

    Metrics: sizes in megabytes and triangles of each tier, counts of holds and routes.

    Raises
    ------
    InputError : files of earlier stages are inconsistent.
    """
    from walltopo.publish.outputs import export_wall
    from walltopo.publish.page_tiers import TIERS
    from walltopo.publish.report import Facts, report_html
    from walltopo.publish.wall_data import wall_model

    progress = context.progress
    wall = wall_model(reads, settings.title or context.title)
    basis = moves_basis(reads.holds.holds, reads.routes.routes)
    kept, moves = context.cache / TIERS, reads.moves is not None and reads.moves.made_for == basis
    if reads.moves is not None and not moves:
        progress.note(
            "moves.json was made for other holds or routes and is not shown: run `walltopo moves`"
        )
    made = export_wall(wall, settings, context.scratch, progress, kept, moves=moves)
    progress.step("report", 1)
    report = context.scratch / "report.html"
    size = made.glb.path.stat().st_size
    facts = Facts.of(reads, context.records)
    text = report_html(wall, facts, made.tiers, size, made.page.path.name)
    report.write_text(text, encoding="utf-8")
    progress.advance()
    volumes = sum(hold.kind == "volume" for hold in wall.holds)
    metrics = made.metrics | {
        "holds": len(wall.holds) - volumes,
        "volumes": volumes,
        "routes": len(wall.routes),
    }
    return Writes(made.glb, made.page_assets, made.page, Made(report), metrics)


EXPORT = Stage("export", PageFiles, Writes, run, version=9, cost=Cost(14, 0.9))

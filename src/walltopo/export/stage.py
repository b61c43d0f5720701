"""The export stage: everything of a finished scan that people and programs open."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import Progress
from walltopo.export.contract import ExportSettings, Reads, Writes
from walltopo.export.kept_tiers import TIERS
from walltopo.export.meshopt import available
from walltopo.export.report import Facts, report_html
from walltopo.export.surface import Look
from walltopo.export.tiers import TierBuilder
from walltopo.export.wall import Wall, wall_of
from walltopo.export.webpage import write_page, write_tier
from walltopo.scans.context import Context
from walltopo.scans.made import Made
from walltopo.scans.manifest import Metrics

__all__ = ["Exported", "export_wall", "run"]


@dataclass(frozen=True)
class Exported:
    """What a wall becomes, made in a scratch folder.

    Parameters
    ----------
    first : the page's first tier, for drawings: labels of an earlier export may be on it.
    metrics : sizes (MB) and triangles of all tiers.
    """

    glb: Made
    page_assets: Made
    page: Made
    first: Look
    metrics: Metrics


def export_wall(
    wall: Wall,
    settings: ExportSettings,
    scratch: Path,
    progress: Progress,
    kept: Path | None = None,
    *,
    moves: bool = False,
) -> Exported:
    """`wall.glb` and the page with its tiers, made in `scratch`.

    Parameters
    ----------
    kept : see `TierBuilder`; moves : see `write_page`.
    """
    metrics: Metrics = {}
    builder = TierBuilder(wall, settings, kept)
    if not available():
        progress.note(
            "meshoptimizer is not installed: the page gets every triangle, uncompressed, and loads "
            "slowly (install a C++ compiler, then pip install meshoptimizer==0.2.30a0)"
        )

    def made(name: str, key: str) -> bytes:
        data = builder.glb(name)
        metrics[f"{key}_mb"] = round(len(data) / 1e6, 3)
        metrics[f"{key}_triangles"] = len(builder.surface(name).triangles)
        return data

    progress.step("glTF tiers", 3)
    glb, assets, page = scratch / "wall.glb", scratch / "page", scratch / "index.html"
    # The simplifier takes one core: the archive, which needs none of the page's tiers, is made
    # beside it, and pictures are encoded while the next tier is made.
    with ThreadPoolExecutor(1) as beside:
        archive = beside.submit(lambda: glb.write_bytes(made("archive", "glb")))
        for name in ("detail", "first"):
            builder.surface(name)
            progress.advance()
        archive.result()
        progress.advance()
    assets.mkdir()
    write_tier(assets, "detail", made("detail", "detail"))
    write_tier(assets, "first", made("first", "first"))
    write_page(page, assets, wall.title, moves)
    return Exported(
        Made(glb),
        Made(assets),
        Made(page),
        builder.drawn("first"),
        metrics,
    )


def run(reads: Reads, settings: ExportSettings, context: Context) -> Writes:
    """`wall.glb`, the page with its assets, and the report.

    Metrics: sizes in megabytes and triangles of each tier, counts of holds and routes.

    Raises
    ------
    InputError : files of earlier stages do not fit each other.
    """
    progress = context.progress
    wall = wall_of(reads, settings.title or context.title)
    kept, moves = context.cache / TIERS, reads.moves is not None
    made = export_wall(wall, settings, context.scratch, progress, kept, moves=moves)
    progress.step("report", 1)
    report = context.scratch / "report.html"
    size = made.glb.path.stat().st_size
    facts = Facts.of(reads, context.records)
    text = report_html(wall, facts, made.first, size, made.page.path.name, context.cache)
    report.write_text(text, encoding="utf-8")
    progress.advance()
    volumes = sum(hold.kind == "volume" for hold in wall.holds)
    metrics = made.metrics | {
        "holds": len(wall.holds) - volumes,
        "volumes": volumes,
        "routes": len(wall.routes),
    }
    return Writes(made.glb, made.page_assets, made.page, Made(report), metrics)

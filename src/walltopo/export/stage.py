"""The export stage: everything of a finished scan that people and programs open."""

from __future__ import annotations

from typing import Any

from walltopo.core import Progress
from walltopo.export.contract import ExportSettings
from walltopo.export.meshopt import available
from walltopo.export.report import write_report
from walltopo.export.tiers import Look, TierBuilder
from walltopo.export.wall import Wall, read_wall
from walltopo.export.webpage import write_page, write_tier
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import atomic_path, write_json

__all__ = ["run", "write_wall"]

ASSETS = "page"


def write_wall(
    scan: ScanFolder, wall: Wall, settings: ExportSettings, progress: Progress
) -> tuple[Look, dict[str, Any]]:
    """Write `holds.json`, `wall.glb` and the page with its tiers.

    Returns
    -------
    The first tier, and sizes (MB) and triangles of all tiers.
    """
    metrics: dict[str, Any] = {}
    builder = TierBuilder(wall, settings)
    if not available():
        progress.note(
            "meshoptimizer is not installed: the page gets every triangle, uncompressed, and loads "
            "slowly (install a C++ compiler, then pip install meshoptimizer==0.2.30a0)"
        )

    def made(name: str, key: str) -> bytes:
        data = builder.glb(name)
        metrics[f"{key}_mb"] = round(len(data) / 1e6, 3)
        metrics[f"{key}_triangles"] = len(builder.look(name).surface.triangles)
        progress.advance()
        return data

    write_json(scan.holds, {"version": 1, "metric": wall.metric, "holds": wall.holds})
    progress.step("glTF tiers", 3)
    data = made("archive", "glb")
    with atomic_path(scan.glb) as temporary:
        temporary.write_bytes(data)
    with atomic_path(scan.root / ASSETS) as folder:
        folder.mkdir()
        write_tier(folder, "detail", made("detail", "detail"))
        write_tier(folder, "first", made("first", "first"))
        with atomic_path(scan.page) as page:
            write_page(page, folder, wall.title)
    return builder.look("first"), metrics


def run(scan: ScanFolder, settings: ExportSettings, progress: Progress) -> dict[str, Any]:
    """Write `holds.json`, `wall.glb`, `index.html` with its assets, and `report.html`.

    Returns
    -------
    Sizes in megabytes and triangles of each tier, counts of holds and routes.

    Raises
    ------
    InputError : an earlier stage's file is missing or does not fit the others.
    """
    progress.step("reading the scan", 1)
    wall = read_wall(scan, settings.title)
    progress.advance()
    first, metrics = write_wall(scan, wall, settings, progress)
    progress.step("report", 1)
    write_report(scan, wall, first, settings, progress)
    progress.advance()
    volumes = sum(hold["class"] == "volume" for hold in wall.holds)
    metrics |= {
        "holds": len(wall.holds) - volumes,
        "volumes": volumes,
        "routes": len(wall.routes),
    }
    return metrics

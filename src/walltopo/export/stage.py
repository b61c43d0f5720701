"""The export stage: everything of a finished scan that people and programs open."""

from __future__ import annotations

from typing import Any

from walltopo.core import Progress
from walltopo.export.params import ExportSettings
from walltopo.export.report import write_report
from walltopo.export.surface import Surface
from walltopo.export.tiers import build_tier
from walltopo.export.wall import Wall, read_wall
from walltopo.export.webpage import write_page, write_tier
from walltopo.workspace import ScanFolder, atomic_path, write_json

__all__ = ["run", "write_wall"]

ASSETS = "page"


def write_wall(
    scan: ScanFolder, wall: Wall, settings: ExportSettings, progress: Progress
) -> tuple[Surface, dict[str, Any]]:
    """Write `holds.json`, `wall.glb` and the page with its tiers.

    Returns
    -------
    The first tier's surface, and sizes (MB) and triangles of the tiers.
    """
    metrics: dict[str, Any] = {}
    write_json(scan.holds, {"version": 1, "metric": wall.metric, "holds": wall.holds})
    progress.step("glTF tiers", 3)
    data, surface = build_tier(wall, "archive", settings)
    with atomic_path(scan.glb) as temporary:
        temporary.write_bytes(data)
    metrics |= {"glb_mb": len(data) / 1e6, "glb_triangles": len(surface.triangles)}
    progress.advance()
    with_detail = len(surface.triangles) > settings.first_triangles or wall.uv is not None
    with atomic_path(scan.root / ASSETS) as folder:
        folder.mkdir()
        data, first = build_tier(wall, "first", settings)
        write_tier(folder, "first", data)
        metrics |= {"first_mb": len(data) / 1e6, "first_triangles": len(first.triangles)}
        progress.advance()
        if with_detail:
            data, surface = build_tier(wall, "detail", settings)
            write_tier(folder, "detail", data)
            metrics |= {"detail_mb": len(data) / 1e6, "detail_triangles": len(surface.triangles)}
        progress.advance()
        with atomic_path(scan.page) as page:
            write_page(page, folder, wall.title, with_detail)
    return first, metrics


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
    for name in ("first", "detail", "glb"):
        if f"{name}_mb" in metrics:
            metrics[f"{name}_mb"] = round(metrics[f"{name}_mb"], 3)
    volumes = sum(hold["class"] == "volume" for hold in wall.holds)
    metrics |= {
        "holds": len(wall.holds) - volumes,
        "volumes": volumes,
        "routes": len(wall.routes),
    }
    return metrics

"""Filling the report's template."""

from __future__ import annotations

import numpy as np

from walltopo.core import Progress
from walltopo.export.contract import ExportSettings
from walltopo.export.report.facts import read_facts
from walltopo.export.report.maps import draw_maps
from walltopo.export.report.pictures import thumbnail
from walltopo.export.templating import render
from walltopo.export.tiers import Look
from walltopo.export.wall import Wall
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import atomic_path

__all__ = ["write_report"]

MOST_TILES = 60  # pictures of one kind
EDGES_OF = 20_000  # triangles whose edges give the median


def _median_edge(wall: Wall) -> float:
    faces = wall.mesh.faces[:: max(1, len(wall.mesh.faces) // EDGES_OF)]
    corners = wall.mesh.vertices[faces]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def write_report(
    scan: ScanFolder, wall: Wall, first: Look, settings: ExportSettings, progress: Progress
) -> None:
    """Write `report.html`: one file that needs no other, and asks no other host for anything.

    Parameters
    ----------
    first : the first tier, which the pictures are drawn from.
    """
    facts = read_facts(scan)
    maps = None
    if facts.views:
        maps = draw_maps(first, facts.views, wall.holds, wall.metric)
    else:
        progress.note("report: no camera positions, so no camera path and no coverage map")

    def photo(name: str) -> str | None:
        return thumbnail(scan.photos / name, 220)

    def cutout(hold: int) -> str | None:
        file = facts.cutouts.get(hold) if settings.thumbnails else None
        return thumbnail(scan.cutouts / file, 128) if file else None

    doubtful = [hold for hold in wall.holds if hold["review"]]
    text = render(
        "report/templates",
        "report.html.jinja",
        wall=wall,
        facts=facts,
        maps=maps,
        page=scan.page.name,
        unsure=sorted(doubtful, key=lambda hold: (float(hold["score"]), int(hold["id"]))),
        colours={hold["id"]: hold["colour_rgb"] for hold in wall.holds if hold["colour_rgb"]},
        edge=_median_edge(wall),
        glb_bytes=scan.glb.stat().st_size,
        steps={name: step for name, step in facts.stages.items() if step.get("seconds")},
        most=MOST_TILES,
        photo=photo,
        cutout=cutout,
    )
    with atomic_path(scan.report) as temporary:
        temporary.write_text(text, encoding="utf-8")

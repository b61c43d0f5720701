"""Filling the report's template."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from walltopo.export.report.facts import Facts
from walltopo.export.report.maps import draw_maps
from walltopo.export.report.pictures import thumbnail
from walltopo.export.surface import Look
from walltopo.export.templating import render
from walltopo.export.wall import Wall
from walltopo.scans.in_words import steepness_words

__all__ = ["report_html"]

MOST_TILES = 60  # pictures of one kind
EDGES_OF = 20_000  # triangles whose edges give the median


def _median_edge(wall: Wall) -> float:
    faces = wall.mesh.faces[:: max(1, len(wall.mesh.faces) // EDGES_OF)]
    corners = wall.mesh.vertices[faces]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def report_html(
    wall: Wall, facts: Facts, first: Look, glb_bytes: int, page: str, cache: Path
) -> str:
    """The report: one file that needs no other, and asks no other host for anything.

    Parameters
    ----------
    first : the first tier, which the pictures are drawn from.
    glb_bytes : size of `wall.glb`; page : file name of the wall's page.
    cache : a folder that may be deleted at any time.
    """

    def photo(name: str) -> str | None:
        return thumbnail(facts.folder.path(name), 220)

    def cutout(hold: int) -> str | None:
        file = facts.cutouts.get(hold)
        return thumbnail(file, 128) if file else None

    doubtful = [hold for hold in wall.holds if hold.review]
    return render(
        "report/templates",
        "report.html.jinja",
        wall=wall,
        facts=facts,
        maps=draw_maps(first, facts.views, wall.holds, wall.metric, cache),
        page=page,
        unsure=sorted(doubtful, key=lambda hold: (hold.score, hold.id)),
        colours={hold.id: hold.colour_rgb for hold in wall.holds},
        edge=_median_edge(wall),
        glb_bytes=glb_bytes,
        steps={name: step for name, step in facts.stages.items() if step.seconds},
        most=MOST_TILES,
        steepness=steepness_words,
        photo=photo,
        cutout=cutout,
    )

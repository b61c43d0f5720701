"""The report's template, the facts in it and its embedded pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import View
from walltopo.publish.report.maps import draw_maps, thumbnail
from walltopo.publish.surface import Look
from walltopo.publish.wall_data import Wall
from walltopo.publish.wall_files import PageFiles
from walltopo.publish.web_page import render
from walltopo.scans.attributes import LeftOut
from walltopo.scans.holds import steepness_words
from walltopo.scans.manifest import StageRecord
from walltopo.scans.photos import Photo, PhotoSet, SkippedFile
from walltopo.scans.scale import Scale

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


@dataclass(frozen=True, eq=False)
class Facts:
    """Photos, stages and scale of one scan.

    Parameters
    ----------
    photos, skipped : what ingest kept and left out; folder : where the photos are.
    views : registered photos, by name.
    unregistered : photo name to the reason ("" where none is known).
    stages : what the stages said in their last runs.
    cutouts : instance id to the file of its best cutout.
    left_out : instances that were too doubtful to be holds, the surest first.
    """

    photos: tuple[Photo, ...]
    skipped: tuple[SkippedFile, ...]
    folder: PhotoSet
    views: tuple[View, ...]
    unregistered: dict[str, str]
    stages: Mapping[str, StageRecord]
    scale: Scale
    cutouts: dict[int, Path]
    left_out: tuple[LeftOut, ...]

    @classmethod
    def of(cls, reads: PageFiles, records: Mapping[str, StageRecord]) -> Facts:
        """From what the export stage is given."""
        views = reads.sparse.views
        known = {view.name for view in views}
        sparse = records.get("sparse")
        reasons = sparse.metrics.get("unregistered", {}) if sparse else {}
        return cls(
            photos=reads.photo_list.photos,
            skipped=reads.photo_list.skipped,
            folder=reads.photos,
            views=views,
            unregistered={
                photo.name: str(reasons.get(photo.name, ""))
                for photo in reads.photo_list.photos
                if photo.name not in known
            },
            stages=records,
            scale=reads.scale,
            cutouts=reads.cutouts.best(),
            left_out=reads.attributes.left_out,
        )

    def metric(self, stage: str, key: str) -> Any:
        """One figure of a stage, or None."""
        record = self.stages.get(stage)
        return record.metrics.get(key) if record else None

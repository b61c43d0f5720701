"""Render the report's template with its facts and embedded pictures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import View
from walltopo.publish.coverage import nearest_counts
from walltopo.publish.page_tiers import PageTiers
from walltopo.publish.report.maps import draw_maps, thumbnail
from walltopo.publish.wall_data import WallModel
from walltopo.publish.wall_files import PageFiles
from walltopo.publish.web_page import render
from walltopo.scans.hidden import are_hidden
from walltopo.scans.holds import Hold, steepness_words
from walltopo.scans.manifest import StageRecord
from walltopo.scans.photos import Photo, PhotoSet, SkippedFile
from walltopo.scans.scale import Scale

MAX_TILES = 60  # maximum number of pictures of one kind

EDGES_OF = 20_000  # number of triangles for the median edge


def _median_edge(wall: WallModel) -> float:
    faces = wall.mesh.faces[:: max(1, len(wall.mesh.faces) // EDGES_OF)]
    corners = wall.mesh.vertices[faces]
    return float(np.median(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)))


def _concealed_holds(wall: WallModel) -> set[int]:
    """Return the ids of holds of which a hidden place covers a part."""
    inside = are_hidden(wall.mesh.centroids, wall.hidden)
    return set(np.unique(wall.face_instance[inside]).tolist()) - {0}


def report_html(wall: WallModel, facts: Facts, tiers: PageTiers, glb_bytes: int, page: str) -> str:
    """Return the report: one self-contained file that loads nothing from other hosts.

    Parameters
    ----------
    tiers : the tiers of the page; the maps are drawn from the first one.
    glb_bytes : size of `wall.glb`; page : file name of the wall's page.
    """

    concealed = _concealed_holds(wall)

    def photo(name: str) -> str | None:
        # Only unregistered photos are shown, in which nobody knows the hidden places.
        return None if wall.hidden else thumbnail(facts.folder.path(name), 220)

    def cutout(hold: int) -> str | None:
        file = facts.cutouts.get(hold)
        return thumbnail(file, 128) if file and hold not in concealed else None

    to_review = [hold for hold in wall.holds if hold.review]
    first = tiers.first()
    seen = nearest_counts(wall.mesh, tiers.coverage(), first.surface.mesh)
    return render(
        "report/templates",
        "report.html.jinja",
        wall=wall,
        facts=facts,
        maps=draw_maps(first, seen, facts.views, wall.holds, wall.metric),
        page=page,
        unsure=sorted(to_review, key=lambda hold: (hold.score, hold.id)),
        colours={hold.id: hold.colour_rgb for hold in wall.holds},
        edge=_median_edge(wall),
        glb_bytes=glb_bytes,
        steps={name: step for name, step in facts.stages.items() if step.seconds},
        most=MAX_TILES,
        steepness=steepness_words,
        photo=photo,
        cutout=cutout,
    )


@dataclass(frozen=True, eq=False)
class Facts:
    """The photos, stages and scale of one scan.

    Parameters
    ----------
    photos, skipped : files that ingest kept and skipped; folder : the photo set.
    views : registered photos, by name.
    unregistered : photo name to the reason ("" if unknown).
    stages : metrics of each stage's last run.
    cutouts : instance id to the file of its best cutout.
    left_out : low-confidence instances, the highest score first.
    """

    photos: tuple[Photo, ...]
    skipped: tuple[SkippedFile, ...]
    folder: PhotoSet
    views: tuple[View, ...]
    unregistered: dict[str, str]
    stages: Mapping[str, StageRecord]
    scale: Scale
    cutouts: dict[int, Path]
    left_out: tuple[Hold, ...]

    @classmethod
    def of(cls, reads: PageFiles, records: Mapping[str, StageRecord]) -> Facts:
        """Collect the facts from the artifacts that the stage `export` reads."""
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
            left_out=reads.holds.left_out,
        )

    def metric(self, stage: str, key: str) -> Any:
        """Return one figure of a stage, or None."""
        record = self.stages.get(stage)
        return record.metrics.get(key) if record else None

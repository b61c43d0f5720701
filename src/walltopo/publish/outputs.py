"""Export `wall.glb`, and the page with its tiers and labels."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import Progress
from walltopo.publish.labels import surface_labels
from walltopo.publish.meshopt import available
from walltopo.publish.page_tiers import PageTiers, page_tiers
from walltopo.publish.settings import ExportSettings
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import WallModel
from walltopo.publish.web_page import LABELS, write_labels, write_page
from walltopo.scans.manifest import Metrics
from walltopo.scans.page_labels import PageLabels
from walltopo.scans.pictures import Made


@dataclass(frozen=True)
class Exported:
    """The exported files of a wall, in a scratch folder.

    Parameters
    ----------
    tiers : the tiers of the page, for drawings.
    metrics : sizes (MB) and triangles of all tiers.
    """

    glb: Made
    page_assets: Made
    page: Made
    tiers: PageTiers
    metrics: Metrics


def export_wall(
    wall: WallModel,
    settings: ExportSettings,
    scratch: Path,
    progress: Progress,
    kept: Path,
    *,
    moves: bool = False,
) -> Exported:
    """Export `wall.glb` and the page with its tiers into `scratch`.

    Parameters
    ----------
    kept : see `page_tiers`; moves : see `write_page`.
    """
    metrics: Metrics = {}
    if not available():
        progress.note(
            "meshoptimizer is not installed: the page gets every triangle, uncompressed, and loads "
            "slowly (install a C++ compiler, then pip install meshoptimizer==0.2.30a0)"
        )

    def archive() -> None:
        builder = TierBuilder(wall, settings)
        data = builder.glb("archive")
        glb.write_bytes(data)
        metrics["glb_mb"] = round(len(data) / 1e6, 3)
        metrics["glb_triangles"] = len(builder.textured_surface("archive").surface.triangles)

    progress.step("build glTF tiers", 3)
    glb, assets, page = scratch / "wall.glb", scratch / "page", scratch / "index.html"
    # The simplifier uses one core. The archive needs no tier of the page, so it is built in
    # parallel, and pictures are encoded while the next tier is built.
    with ThreadPoolExecutor(1) as beside:
        pending = beside.submit(archive)
        tiers = page_tiers(wall, settings, kept, progress.advance)
        pending.result()
        progress.advance()
    assets.mkdir()
    tiers.link_into(assets)
    for name, count in tiers.triangles.items():
        metrics[f"{name}_mb"] = tiers.megabytes(name)
        metrics[f"{name}_triangles"] = count
    write_labels(assets, page_labels(wall))
    metrics["labels_mb"] = round((assets / LABELS).stat().st_size / 1e6, 3)
    write_page(page, assets, wall.title, moves)
    return Exported(Made(glb), Made(assets), Made(page), tiers, metrics)


def page_labels(wall: WallModel) -> PageLabels:
    """Return the content that the page's tiers lack: names, tables and labels."""
    patches = wall.face_instance if wall.patches is None else wall.patches
    return PageLabels(
        title=wall.title,
        metric=wall.metric,
        holds=tuple(wall.holds),
        routes=tuple(wall.routes),
        surface=surface_labels(wall.mesh, patches, wall.face_instance),
    )

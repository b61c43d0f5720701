"""`wall.glb` and the page with its tiers."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from walltopo.core import Progress
from walltopo.publish.meshopt import available
from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import Look
from walltopo.publish.tiers import TierBuilder
from walltopo.publish.wall_data import Wall
from walltopo.publish.web_page import write_page, write_tier
from walltopo.scans.manifest import Metrics
from walltopo.scans.pictures import Made


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

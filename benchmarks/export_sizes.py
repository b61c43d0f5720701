"""Sizes of the exported tiers: `python -m benchmarks.export_sizes SCAN [SCAN ...]`.

Builds each tier of finished scans in memory. Prints triangles, vertices, bytes, triangles that mix
two ids, and the bytes loaded before the wall is visible (compressed viewer script plus first tier).
"""

from __future__ import annotations

import gzip
import sys
import time
from pathlib import Path

from walltopo.publish.settings import ExportSettings
from walltopo.publish.surface import mixed_triangles
from walltopo.publish.tiers import TIERS, TierBuilder
from walltopo.publish.wall_data import read_wall
from walltopo.publish.web_page import viewer_script
from walltopo.scans.folder import ScanFolder


def report(folder: Path, script: int) -> None:
    """Print the tiers of one scan."""
    began = time.process_time()
    wall = read_wall(ScanFolder(folder))
    builder = TierBuilder(wall, ExportSettings())
    print(f"{folder}: {len(wall.mesh.faces):,} triangles, {len(wall.holds)} holds")
    print("| tier | triangles | vertices | MB | mixed ids |\n|---|---|---|---|---|")
    for name in TIERS:
        data, surface = builder.glb(name), builder.textured_surface(name).surface
        row = (f"{len(surface.triangles):,}", f"{len(surface.positions):,}")
        print(
            f"| {name} | {' | '.join(row)} | {len(data) / 1e6:.2f} | {mixed_triangles(surface)} |"
        )
        if name == "first":
            print(f"| first load: script + tier | | | {(script + len(data)) / 1e6:.2f} | |")
    print(f"CPU-seconds: {time.process_time() - began:.0f}\n")


def main() -> None:
    """Run the command line."""
    if len(sys.argv) < 2:
        sys.exit(__doc__)
    script = len(gzip.compress(viewer_script().read_bytes(), 9))
    print(f"viewer script: {script / 1e3:.0f} kB gzip")
    for folder in sys.argv[1:]:
        report(Path(folder), script)


if __name__ == "__main__":
    main()

"""Lower bound of any lift: the minimum of its reads and writes, and the time of those alone.

    python -m benchmarks.lift_floor DATA       # DATA: the folder with gym-a/lift

The triangles that a view sees depend on all triangles in its photo. So each view reads those once
(three vertex numbers, and each vertex), each mask is read once, and each sighting (a triangle that
a view sees) is written once. `plain` does only this, on all cores; the lift is timed in the same
run.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.lift import timed
from benchmarks.lift_accuracy import load_gym
from walltopo.core import Mesh, Silent, View
from walltopo.core.parallel import available_cores
from walltopo.geometry.kernels import kernel
from walltopo.segment.lift import LiftParams, lift
from walltopo.segment.lift.blocks import Blocks, blocks_of
from walltopo.segment.lift.evidence import Evidence, slope_bounds
from walltopo.segment.lift.robust import robust_evidence
from walltopo.segment.lift.visibility import cull_blocks

# Bytes of the mask and view numbers, the share, the distance to the border and the resolution.
_SIGHTING_BYTES = 20


@kernel
def _read(which: Any, blocks: Any, vertex_starts: Any, vertices: Any, faces: Any) -> Any:
    """Add up all vertices and vertex numbers of some blocks, so that each byte is read once."""
    total, numbers = 0.0, 0
    for b in which:
        for v in range(vertex_starts[b], vertex_starts[b + 1]):
            total += vertices[v, 0] + vertices[v, 1] + vertices[v, 2]
        for f in range(blocks[b], blocks[b + 1]):
            numbers += faces[f, 0] + faces[f, 1] + faces[f, 2]
    return total + numbers


def _in_photo(blocks: Blocks, view: View, limit: float) -> Any:
    pose = tuple(view.cam_from_world.ravel().tolist())
    return cull_blocks(blocks.spheres, pose, slope_bounds(view.camera), limit)


def plain(blocks: Blocks, views: Sequence[View], evidence: Evidence, params: LiftParams) -> None:
    """Read all triangles in the views' photos, and write all sightings."""

    def looked(view: View) -> None:
        which = _in_photo(blocks, view, params.visibility_distance)
        _read(which, blocks.starts, blocks.vertex_starts, blocks.vertices, blocks.faces)
        for mask in view.masks:
            np.count_nonzero(mask.bitmap)

    def copied(column: Any) -> None:
        column.copy()

    columns = (evidence.projection, evidence.view, evidence.share, evidence.border, evidence.detail)
    with ThreadPoolExecutor(available_cores()) as pool:
        list(pool.map(looked, views))
        list(pool.map(copied, columns))


def measure(mesh: Mesh, views: Sequence[View]) -> None:
    """Print the counts, the plain pass and the lift."""
    params = LiftParams()
    blocks = blocks_of(mesh)
    evidence = robust_evidence(mesh, views, params, Silent())
    triangles = vertices = 0
    for view in views:
        which = _in_photo(blocks, view, params.visibility_distance)
        triangles += int(np.diff(blocks.starts)[which].sum())
        vertices += int(np.diff(blocks.vertex_starts)[which].sum())
    masks = sum(mask.bitmap.nbytes for view in views for mask in view.masks)
    sightings = len(evidence.view)
    print("| at least | number | MB |\n|---|---|---|")
    print(f"| triangles in photos, once a view | {triangles:,} | {triangles * 12 / 1e6:.0f} |")
    print(f"| their vertices | {vertices:,} | {vertices * 24 / 1e6:.0f} |")
    print(f"| pixels in the masks' boxes | {masks:,} | {masks / 1e6:.0f} |")
    print(f"| sightings | {sightings:,} | {sightings * _SIGHTING_BYTES / 1e6:.0f} |")
    plain(blocks, views, evidence, params)
    floor, _ = timed(lambda: plain(blocks, views, evidence, params), 5)
    lift(mesh, views, params)
    wall, _ = timed(lambda: lift(mesh, views, params), 5)
    print(f"\nthat alone: {floor:.3f} s; the lift: {wall:.3f} s, {wall / floor:.1f} times as long")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("data", type=Path, metavar="DATA")
    mesh, views, _ = load_gym(parser.parse_args().data, "noisy")
    measure(mesh, views)


if __name__ == "__main__":
    main()

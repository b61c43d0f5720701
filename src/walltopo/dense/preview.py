"""The `sparse` backend: a rough mesh in seconds, from the sparse points alone.

In each photo the points it sees are joined by Delaunay triangles; the depths interpolated over
them are fused like depth maps from stereo.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.dense.contract import DenseSettings
from walltopo.dense.depth import DepthMap
from walltopo.dense.marching_cubes import extract
from walltopo.dense.remesh import finish
from walltopo.dense.scene import Scene, surroundings
from walltopo.dense.tsdf import find_space, fused

__all__ = ["interpolated_depth", "preview_mesh"]

Depth = NDArray[np.float32]

# Depth maps of this many pixels on the longer side; finer shows nothing more of sparse points.
_MAP_SIZE = 320
# Edges of the mesh, in those of the other backends, and in pixels of the small depth maps.
_COARSER = 4.0
_TRUNCATION_VOXELS = 4.0


def interpolated_depth(scene: Scene, index: int) -> tuple[Depth, View] | None:
    """Depth of a view interpolated between the points it sees, 0 beyond them, and its small
    pinhole view; None with fewer than 4 points."""
    from scipy.interpolate import LinearNDInterpolator

    view = scene.views[index]
    factor = _MAP_SIZE / max(view.camera.width, view.camera.height)
    small = View(view.name, view.camera.pinhole().scaled(factor), view.cam_from_world)
    local = small.to_camera(scene.points[scene.seen[index]])
    local = local[local[:, 2] > 0]
    pixels = small.camera.project(local)
    if len(local) < 4 or np.ptp(pixels, axis=0).min() < 2.0:
        return None
    # A plane is linear in inverse depth.
    linear = LinearNDInterpolator(pixels, 1.0 / local[:, 2], fill_value=np.nan)
    columns = np.arange(small.camera.width) + 0.5
    rows = np.arange(small.camera.height) + 0.5
    inverse = linear(*np.meshgrid(columns, rows))
    depth = np.where(np.isfinite(inverse), 1.0 / np.where(inverse > 0, inverse, np.nan), np.nan)
    return np.nan_to_num(depth, nan=0.0).astype(np.float32), small


def preview_mesh(
    scene: Scene, settings: DenseSettings, edge: float, unit: float, progress: Progress
) -> Mesh:
    """A coarse, clean mesh.

    Parameters
    ----------
    scene, settings, progress : as in `sgm.sgm_mesh`.
    edge : edge length that stereo would aim for, world units; the preview's is four times that.
    unit : world units that `settings` calls a metre.
    """
    progress.step("interpolating depths", len(scene.views))
    maps: list[tuple[Depth, View]] = []
    for k in range(len(scene.views)):
        found = interpolated_depth(scene, k)
        if found is not None:
            maps.append(found)
        progress.advance()
    if not maps:
        raise StageError("no photo sees enough sparse points for a preview", "Take more photos.")
    low, high = surroundings(scene)
    voxel = _COARSER * edge
    space = find_space(maps, low, high, voxel, _TRUNCATION_VOXELS * voxel)
    weighted = [
        DepthMap(depth, (depth > 0).astype(np.float32), np.zeros(depth.shape, np.uint8), view)
        for depth, view in maps
    ]
    return finish(extract(fused(space, weighted, progress), 0.5), settings, voxel, unit)

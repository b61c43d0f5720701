"""Views and sparse points that every dense backend starts from; the rough `sparse` backend."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.reconstruct.dense.depth_maps import DepthMap
from walltopo.reconstruct.dense.marching_cubes import extract
from walltopo.reconstruct.dense.remesh import finish
from walltopo.reconstruct.dense.settings import DenseSettings
from walltopo.reconstruct.dense.tsdf import find_space, fused
from walltopo.scans.colmap_model import open_model, view_of_image

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """Posed views and sparse points.

    Parameters
    ----------
    views : sorted by name.
    points : (P, 3) float64, world frame.
    seen : per view, sorted indices (n,) int64 of the points it observes.
    """

    views: tuple[View, ...]
    points: Floats
    seen: tuple[NDArray[np.int64], ...]

    def depths(self, index: int) -> Floats:
        """(n,) z-depths of the points that view `index` sees, those ahead of it only."""
        z = self.views[index].to_camera(self.points[self.seen[index]])[:, 2]
        return z[z > 0]

    def subset(self, keep: list[int]) -> Scene:
        """The scene of some of the views, with all points."""
        return Scene(
            tuple(self.views[k] for k in keep), self.points, tuple(self.seen[k] for k in keep)
        )


def read_scene(path: Path) -> Scene:
    """The registered views and points of a COLMAP model.

    Raises
    ------
    InputError : no readable model there.
    StageError : fewer than two views, or no points.
    """
    model = open_model(path)
    images = sorted((i for i in model.images.values() if i.has_pose), key=lambda i: i.name)
    ids = np.array(sorted(model.points3D), dtype=np.int64)
    if len(images) < 2 or len(ids) == 0:
        raise StageError(
            f"{path}: {len(images)} registered photos and {len(ids)} points; "
            "a mesh needs at least two photos that see the same points",
            "Take more photos with more overlap.",
        )
    points = np.array([model.points3D[i].xyz for i in ids.tolist()], dtype=np.float64)
    seen: list[NDArray[np.int64]] = []
    for image in images:
        observed = [p.point3D_id for p in image.points2D if p.has_point3D()]
        seen.append(np.unique(np.searchsorted(ids, np.array(observed, dtype=np.int64))))
    return Scene(tuple(view_of_image(image) for image in images), points, tuple(seen))


def ground_sampling(scene: Scene) -> float:
    """Median size of a photo's pixel on the surface, in world units."""
    sizes = [
        float(np.median(z)) / scene.views[k].camera.fx
        for k in range(len(scene.views))
        if len(z := scene.depths(k))
    ]
    if not sizes:
        raise StageError("no view sees any sparse point; the mesh's scale is unknown")
    return float(np.median(sizes))


def surroundings(scene: Scene) -> tuple[Floats, Floats]:
    """Least and largest corner (3,) of the box that holds the surface worth meshing.

    The box of the points without its outermost 0.5 % on each side, widened by 10 % of
    its diagonal.
    """
    used = scene.points[np.unique(np.concatenate(scene.seen))]
    low, high = np.percentile(used, [0.5, 99.5], axis=0)
    margin = 0.1 * float(np.linalg.norm(high - low))
    return low - margin, high + margin


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

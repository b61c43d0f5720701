"""Load the views and sparse points of a scan; mesh them roughly (backend `sparse`)."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, Progress, StageError, View
from walltopo.reconstruct.dense.depth_maps import DepthMap
from walltopo.reconstruct.dense.marching_cubes import extract
from walltopo.reconstruct.dense.remesh import finish_surface
from walltopo.reconstruct.dense.tsdf import find_space, fuse
from walltopo.reconstruct.settings import DenseSettings
from walltopo.scans.colmap_model import open_model, view_of_image

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Scene:
    """Posed views and sparse points.

    Parameters
    ----------
    views : sorted by name.
    points : (P, 3) float64, world frame.
    seen : per view, sorted indices (n,) int64 of the observed points.
    """

    views: tuple[View, ...]
    points: Floats
    seen: tuple[NDArray[np.int64], ...]

    def depths(self, index: int) -> Floats:
        """Return the (n,) positive z-depths of the points that view `index` observes."""
        z = self.views[index].to_camera(self.points[self.seen[index]])[:, 2]
        return z[z > 0]

    def subset(self, keep: list[int]) -> Scene:
        """Return the scene with some of its views and all points."""
        return Scene(
            tuple(self.views[k] for k in keep), self.points, tuple(self.seen[k] for k in keep)
        )


def read_scene(path: Path) -> Scene:
    """Read the registered views and the points of a COLMAP model.

    Raises
    ------
    InputError : the folder holds no readable model.
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


def median_pixel_size(scene: Scene) -> float:
    """Return the median size of a photo pixel on the surface, in world units."""
    sizes = [
        float(np.median(z)) / scene.views[k].camera.fx
        for k in range(len(scene.views))
        if len(z := scene.depths(k))
    ]
    if not sizes:
        raise StageError("no photo observes any sparse point, so the mesh's resolution is unknown")
    return float(np.median(sizes))


def meshing_box(scene: Scene) -> tuple[Floats, Floats]:
    """Return the minimum and maximum corner (3,) of the box to mesh.

    The box spans the 0.5th to 99.5th percentile of the points, widened by 10 % of its diagonal.
    """
    used = scene.points[np.unique(np.concatenate(scene.seen))]
    low, high = np.percentile(used, [0.5, 99.5], axis=0)
    margin = 0.1 * float(np.linalg.norm(high - low))
    return low - margin, high + margin


Depth = NDArray[np.float32]

# Longer side of the interpolated depth maps, pixels; sparse points carry no finer detail.
_MAP_SIZE = 320

# Edge length of the preview relative to that of the other backends.
_COARSER = 4.0

_TRUNCATION_VOXELS = 4.0


def interpolated_depth(scene: Scene, index: int) -> tuple[Depth, View] | None:
    """Interpolate the depth of a view between its sparse points.

    Returns
    -------
    (H, W) float32 z-depth, 0 outside the points' convex hull, and the reduced pinhole view; None
    with fewer than 4 points.
    """
    from scipy.interpolate import LinearNDInterpolator

    view = scene.views[index]
    factor = _MAP_SIZE / max(view.camera.width, view.camera.height)
    small = View(view.name, view.camera.pinhole().scaled(factor), view.cam_from_world)
    local = small.to_camera(scene.points[scene.seen[index]])
    local = local[local[:, 2] > 0]
    pixels = small.camera.project(local)
    if len(local) < 4 or np.ptp(pixels, axis=0).min() < 2.0:
        return None
    # The inverse depth of a plane is linear in the pixel.
    linear = LinearNDInterpolator(pixels, 1.0 / local[:, 2], fill_value=np.nan)
    columns = np.arange(small.camera.width) + 0.5
    rows = np.arange(small.camera.height) + 0.5
    inverse = linear(*np.meshgrid(columns, rows))
    depth = np.where(np.isfinite(inverse), 1.0 / np.where(inverse > 0, inverse, np.nan), np.nan)
    return np.nan_to_num(depth, nan=0.0).astype(np.float32), small


def preview_mesh(
    scene: Scene, settings: DenseSettings, edge: float, unit: float, progress: Progress
) -> Mesh:
    """Compute a coarse, clean mesh from the sparse points alone.

    Parameters
    ----------
    scene, settings, progress : as in `sgm.sgm_mesh`.
    edge : target edge length of the stereo backends, world units; the preview uses four times it.
    unit : length of a settings metre, world units.
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
    low, high = meshing_box(scene)
    voxel = _COARSER * edge
    space = find_space(maps, low, high, voxel, _TRUNCATION_VOXELS * voxel)
    weighted = [
        DepthMap(depth, (depth > 0).astype(np.float32), np.zeros(depth.shape, np.uint8), view)
        for depth, view in maps
    ]
    return finish_surface(extract(fuse(space, weighted, progress), 0.5), settings, voxel, unit)

"""What every dense backend starts from: views and the sparse points they see."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError, View
from walltopo.scans.model import open_model, view_of_image

__all__ = ["Scene", "ground_sampling", "read_scene", "surroundings"]

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

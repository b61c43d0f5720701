"""COLMAP models rebuilt from a choice of images, and models that share photos joined."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_SHARED = 3  # photos that two models must share

_AGREEING = 0.5  # of what the shared photos see must fit

_FIT_PX = 8.0

_SEEN = 30  # points that a photo must see in the joined model


def join_models(
    models: Mapping[int, Any], database: Path, photos: Path, output: Path, options: Any
) -> Any | None:
    """The largest model with every other one that can be joined to it; None where none can.

    Parameters
    ----------
    models : of `pycolmap.incremental_mapping`.
    database, photos : that they were made from.
    output : folder for the joined model.
    options : the mapper's `pycolmap.IncrementalPipelineOptions`.
    """
    order = sorted(models, key=lambda key: (-models[key].num_reg_images(), key))
    whole = models[order[0]]
    for key in order[1:]:
        together = _together(whole, models[key])
        if together is None:
            continue
        output.mkdir(parents=True, exist_ok=True)
        again = _triangulated(together, database, photos, output, options)
        if _holds(again, together.num_reg_images()):
            whole = again
    return None if whole is models[order[0]] else whole


def _together(whole: Any, other: Any) -> Any | None:
    """The cameras of both, in the frame of the first; None where they do not fit or add none."""
    from walltopo.geometry.colmap import pycolmap

    shared = {one for one, _ in whole.find_common_reg_image_ids(other)}
    if len(shared) < _SHARED or other.num_reg_images() == len(shared):
        return None
    move = pycolmap.align_reconstructions_via_reprojections(
        other, whole, min_inlier_observations=_AGREEING, max_reproj_error=_FIT_PX
    )
    if move is None:
        return None
    other.transform(move)
    result = pycolmap.Reconstruction()
    for model in (whole, other):
        for number, camera in model.cameras.items():
            if not result.exists_camera(number):
                result.add_camera_with_trivial_rig(camera)
        for number in sorted(model.reg_image_ids()):
            if not result.exists_image(number):
                _copy_camera(result, model.images[number])
    return result


def _copy_camera(result: Any, image: Any) -> None:
    from walltopo.geometry.colmap import pycolmap

    keypoints = [point.xy for point in image.points2D]
    copy = pycolmap.Image(
        name=image.name, keypoints=keypoints, camera_id=image.camera_id, image_id=image.image_id
    )
    result.add_image_with_trivial_frame(copy, image.cam_from_world())


def _triangulated(model: Any, database: Path, photos: Path, output: Path, options: Any) -> Any:
    from walltopo.geometry.colmap import pycolmap

    return pycolmap.triangulate_points(model, database, photos, output, options=options)


def _holds(model: Any, cameras: int) -> bool:
    """Every camera still sees points."""
    seen = [image.num_points3D for image in model.images.values() if image.has_pose]
    return len(seen) == cameras and min(seen) >= _SEEN


Floats = NDArray[np.float64]

_SAME_SPOT = 0.75  # px; keypoints found again in the same photo lie this near


@dataclass(frozen=True, eq=False)
class KeptImage:
    """What an image of a model becomes in the rebuilt one.

    Parameters
    ----------
    source : the `pycolmap.Image`.
    image_id, name, camera_id : its new ones.
    keypoints : (n, 2) float, the new keypoints, pixels.
    index : (m,) int, per keypoint of the source its number among the new ones, -1 = none.
    """

    source: Any
    image_id: int
    name: str
    camera_id: int
    keypoints: Floats
    index: NDArray[np.int64]


def rebuild(model: Any, kept: Iterable[KeptImage], camera_ids: Mapping[int, int]) -> Any:
    """A new `pycolmap.Reconstruction` of the kept images and the points two of them share.

    Poses and intrinsics are copied, never recomputed.

    Parameters
    ----------
    model : the source `pycolmap.Reconstruction`.
    kept : registered images of it.
    camera_ids : old to new camera id, for each camera that is wanted.
    """
    from walltopo.geometry.colmap import pycolmap

    result = pycolmap.Reconstruction()
    for old, new in camera_ids.items():
        camera = pycolmap.Camera(model.cameras[old].todict())
        camera.camera_id = new
        result.add_camera_with_trivial_rig(camera)
    by_source: dict[int, KeptImage] = {}
    for entry in kept:
        image = pycolmap.Image(
            name=entry.name,
            keypoints=entry.keypoints,
            camera_id=entry.camera_id,
            image_id=entry.image_id,
        )
        result.add_image_with_trivial_frame(image, entry.source.cam_from_world())
        by_source[int(entry.source.image_id)] = entry
    for point in model.points3D.values():
        elements: dict[int, int] = {}
        for seen in point.track.elements:
            found = by_source.get(seen.image_id)
            if found is not None and found.index[seen.point2D_idx] >= 0:
                elements[found.image_id] = int(found.index[seen.point2D_idx])
        if len(elements) >= 2:
            track = pycolmap.Track([pycolmap.TrackElement(a, b) for a, b in elements.items()])
            result.add_point3D(point.xyz, track, point.color)
    result.update_point_3d_errors()
    return result


def match_keypoints(old: Floats, new: Floats, wanted: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Number among `new` (n, 2) of each keypoint of `old` (m, 2), -1 where none is at its spot.

    The same photo with the same settings gives the same keypoints in the same order; with other
    settings, each wanted one takes the nearest, and no two take the same.
    """
    if old.shape == new.shape and np.allclose(old, new, atol=1e-3):
        return np.arange(len(old))
    from scipy.spatial import cKDTree

    index = np.full(len(old), -1, dtype=np.int64)
    rows = np.flatnonzero(wanted)
    if not len(rows) or not len(new):
        return index
    away, nearest = cKDTree(new).query(old[rows], distance_upper_bound=_SAME_SPOT)
    order = np.argsort(away, kind="stable")
    order = order[np.isfinite(away[order])]
    _, first = np.unique(nearest[order], return_index=True)
    chosen = order[first]
    index[rows[chosen]] = nearest[chosen]
    return index

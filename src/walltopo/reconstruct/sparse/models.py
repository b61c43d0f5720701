"""Join COLMAP models that share photos, and rebuild models from a subset of their images."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

_MIN_SHARED = 3  # photos that two models must share

_MIN_INLIER_SHARE = 0.5  # share of the shared photos' observations that must fit

_FIT_PX = 8.0

_MIN_POINTS = 30  # points that each photo must see in the joined model


def join_models(
    models: Mapping[int, Any], database: Path, photos: Path, output: Path, options: Any
) -> Any | None:
    """Join every model that fits to the largest first; return None if no model can be joined.

    Parameters
    ----------
    models : result of `pycolmap.incremental_mapping`.
    database, photos : COLMAP's database and the folder of the photos.
    output : folder for the joined model.
    options : the mapper's `pycolmap.IncrementalPipelineOptions`.
    """
    order = sorted(models, key=lambda key: (-models[key].num_reg_images(), key))
    largest = models[order[0]]
    for key in order[1:]:
        joined = _merge_models(largest, models[key])
        if joined is None:
            continue
        output.mkdir(parents=True, exist_ok=True)
        result = _triangulate_points(joined, database, photos, output, options)
        if _sees_points(result, joined.num_reg_images()):
            largest = result
    return None if largest is models[order[0]] else largest


def _merge_models(largest: Any, other: Any) -> Any | None:
    """Return the cameras of both models in the first first's frame; None if they do not fit or add
    none."""
    from walltopo.geometry.colmap import pycolmap

    shared = {first for first, _ in largest.find_common_reg_image_ids(other)}
    if len(shared) < _MIN_SHARED or other.num_reg_images() == len(shared):
        return None
    move = pycolmap.align_reconstructions_via_reprojections(
        other, largest, min_inlier_observations=_MIN_INLIER_SHARE, max_reproj_error=_FIT_PX
    )
    if move is None:
        return None
    other.transform(move)
    result = pycolmap.Reconstruction()
    for model in (largest, other):
        for number, camera in model.cameras.items():
            if not result.exists_camera(number):
                result.add_camera_with_trivial_rig(camera)
        for number in sorted(model.reg_image_ids()):
            if not result.exists_image(number):
                copy_image(result, model.images[number])
    return result


def copy_image(result: Any, image: Any) -> None:
    """Add an image with its keypoints, pose and ids to a model that has its camera."""
    from walltopo.geometry.colmap import pycolmap

    keypoints = [point.xy for point in image.points2D]
    copy = pycolmap.Image(
        name=image.name, keypoints=keypoints, camera_id=image.camera_id, image_id=image.image_id
    )
    result.add_image_with_trivial_frame(copy, image.cam_from_world())


def _triangulate_points(
    model: Any, database: Path, photos: Path, output: Path, options: Any
) -> Any:
    """Triangulate the points of a model from the matches of the database."""
    from walltopo.geometry.colmap import pycolmap

    return pycolmap.triangulate_points(model, database, photos, output, options=options)


def _sees_points(model: Any, cameras: int) -> bool:
    """Return whether all cameras remain and each sees at least `_MIN_POINTS` points."""
    seen = [image.num_points3D for image in model.images.values() if image.has_pose]
    return len(seen) == cameras and min(seen) >= _MIN_POINTS


Floats = NDArray[np.float64]

_SAME_KEYPOINT_PX = 0.75  # px; maximum distance of a keypoint detected twice


@dataclass(frozen=True, eq=False)
class KeptImage:
    """An image of a model and its new ids and keypoints in the rebuilt model.

    Parameters
    ----------
    source : `pycolmap.Image` of the old model.
    image_id, name, camera_id : new ids and name.
    keypoints : (n, 2) float, the new keypoints, pixels.
    index : (m,) int, for each keypoint of the source its index in `keypoints`, -1 = none.
    """

    source: Any
    image_id: int
    name: str
    camera_id: int
    keypoints: Floats
    index: NDArray[np.int64]


def rebuild(model: Any, kept: Iterable[KeptImage], camera_ids: Mapping[int, int]) -> Any:
    """Return a new `pycolmap.Reconstruction` of the kept images and the points that two of them
    share.

    Poses and intrinsics are copied, never recomputed.

    Parameters
    ----------
    model : the source `pycolmap.Reconstruction`.
    kept : registered images to keep.
    camera_ids : maps old to new camera ids of the cameras to keep.
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
    """Return for each keypoint of `old` (m, 2) its index in `new` (n, 2), -1 if unmatched.

    The same photo and settings give the same keypoints in the same order. With other settings, each
    wanted keypoint matches the nearest new one within `_SAME_KEYPOINT_PX`; matches are unique.
    """
    if old.shape == new.shape and np.allclose(old, new, atol=1e-3):
        return np.arange(len(old))
    from scipy.spatial import cKDTree

    index = np.full(len(old), -1, dtype=np.int64)
    rows = np.flatnonzero(wanted)
    if not len(rows) or not len(new):
        return index
    away, nearest = cKDTree(new).query(old[rows], distance_upper_bound=_SAME_KEYPOINT_PX)
    order = np.argsort(away, kind="stable")
    order = order[np.isfinite(away[order])]
    _, first = np.unique(nearest[order], return_index=True)
    chosen = order[first]
    index[rows[chosen]] = nearest[chosen]
    return index

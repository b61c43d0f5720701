"""Models of one wall that share photos, put together: part of the child process that calls COLMAP.

The mapper ends a model where no further photo sees enough of its points, and starts another one
from what is left; it may take photos of the first again. Where two models share three photos or
more, what those see says how one lies to the other. Points are then triangulated anew from all
cameras; what is put together wrongly loses them, and is left apart.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

__all__ = ["join_models"]

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
    from walltopo.colmap import pycolmap

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
    from walltopo.colmap import pycolmap

    keypoints = [point.xy for point in image.points2D]
    copy = pycolmap.Image(
        name=image.name, keypoints=keypoints, camera_id=image.camera_id, image_id=image.image_id
    )
    result.add_image_with_trivial_frame(copy, image.cam_from_world())


def _triangulated(model: Any, database: Path, photos: Path, output: Path, options: Any) -> Any:
    from walltopo.colmap import pycolmap

    return pycolmap.triangulate_points(model, database, photos, output, options=options)


def _holds(model: Any, cameras: int) -> bool:
    """Every camera still sees points."""
    seen = [image.num_points3D for image in model.images.values() if image.has_pose]
    return len(seen) == cameras and min(seen) >= _SEEN

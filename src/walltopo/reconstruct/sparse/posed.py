"""Start a mapping from given poses: triangulate, refine, register the photos without a pose.

A phone's poses drift by centimetres and tenths of a degree. So points are first accepted with
generous errors, the poses are refined, and points are triangulated again with COLMAP's own limits.
Position priors hold parts of the scene that share no points with others.

Lens parameters beyond COLMAP's OPENCV are kept as given. Adjusted on one wall, the eight of
FULL_OPENCV and the four of OPENCV_FISHEYE leave all bounds (k2 = 137), and COLMAP then drops every
photo of that camera.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from copy import deepcopy
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Camera
from walltopo.reconstruct.sparse.jobs import CameraEntry, ColmapJob, MapTask

# Reprojection errors (px per 1,000 px of the longer side) that points may have, by round.
_ROUNDS = (16.0, 4.0)

_MIN_PX = 4.0  # COLMAP's own limit

_MIN_PHOTO_POINTS = 15  # a photo that sees fewer points is not placed by its pose alone

# Standard deviation of a given position, as a share of the diagonal of all positions: 10 cm on a
# wall of five metres, weak against the points, and enough for parts that no point connects.
_POSITION_SHARE = 0.02

# Fewer verified matches between posed photos say nothing about the poses.
_MIN_MATCHES = 100

_KEPT_LENSES = ("FULL_OPENCV", "OPENCV_FISHEYE")


def keeps_lens(models: Iterable[str]) -> bool:
    """Return whether a bundle adjustment must keep the distortion of cameras of these models."""
    return any(model in _KEPT_LENSES for model in models)


def allow_given_lenses(options: Any, cameras: Iterable[CameraEntry]) -> None:
    """Let COLMAP use the given lens parameters as they are, in place.

    COLMAP takes a camera with a parameter above 1 for a failed calibration. Rational lenses of
    OpenCV have parameters of 20 and more.

    Parameters
    ----------
    options : `pycolmap.IncrementalPipelineOptions`.
    """
    lenses = [Camera(one.model, one.width, one.height, one.params) for one in cameras]
    largest = max((abs(value) for lens in lenses for value in lens.distortion), default=0.0)
    for part in (options, options.mapper, options.triangulation):
        part.max_extra_param = max(part.max_extra_param, 2 * largest)
    if keeps_lens(lens.model for lens in lenses):
        options.ba_refine_extra_params = False
        options.mapper.abs_pose_refine_extra_params = False


def start_from_poses(
    database: Path,
    job: ColmapJob,
    task: MapTask,
    options: Any,
    event: Callable[..., None],
) -> dict[int, Any] | None:
    """Return the model by its number 0; empty without common points; None for a contradiction.

    The poses contradict the photos if there are matches enough, and too few of them meet in points.

    Parameters
    ----------
    options : the mapper's `pycolmap.IncrementalPipelineOptions`.
    event : writes an event of the worker.
    """
    from walltopo.geometry.colmap import pycolmap

    allow_given_lenses(options, job.cameras)
    model = pycolmap.Reconstruction(task.posed)
    positions = {number: image.projection_center() for number, image in model.images.items()}
    longest = max(max(camera.width, camera.height) for camera in model.cameras.values())
    event(step="poses", total=len(_ROUNDS))
    for limit in _ROUNDS:
        model = _triangulate_posed(model, database, job, task, options, limit * longest / 1000)
        explained = _explained_share(model, database)
        _drop_unseen(model)
        if model.num_reg_images() < 2:
            return {} if explained is None or explained >= task.min_explained else None
        _refine_near(model, positions, job.seed)
        event(advance=1)
    explained = _explained_share(model, database)
    if explained is not None and explained < task.min_explained:
        return None
    if model.num_reg_images() < task.expected:
        model = _register_others(model, database, job, task, options, event)
    return {0: model}


def _triangulate_posed(
    model: Any, database: Path, job: ColmapJob, task: MapTask, options: Any, limit: float
) -> Any:
    """Return the model with points of at most `limit` px error, triangulated in its poses."""
    from walltopo.geometry.colmap import pycolmap

    chosen = deepcopy(options)
    limit = max(limit, _MIN_PX)
    chosen.mapper.filter_max_reproj_error = limit
    chosen.triangulation.merge_max_reproj_error = limit
    chosen.triangulation.complete_max_reproj_error = limit
    # Two photos alone see a point in smooth places; the angle limits stay.
    chosen.triangulation.ignore_two_view_tracks = False
    output = Path(task.output) / "0"
    output.mkdir(exist_ok=True)
    return pycolmap.triangulate_points(model, database, job.image_root, output, options=chosen)


def _drop_unseen(model: Any) -> None:
    """Remove the poses of photos that see too few points."""
    for image in list(model.images.values()):
        if image.has_pose and image.num_points3D < _MIN_PHOTO_POINTS:
            model.deregister_frame(image.frame_id)


def _explained_share(model: Any, database: Path) -> float | None:
    """Return the share of the verified matches between placed photos that are one point.

    The share is None if there are fewer than `_MIN_MATCHES`.
    """
    from walltopo.geometry.colmap import pycolmap

    placed = {image.image_id: image for image in model.images.values() if image.has_pose}
    point_of = {
        number: np.array([p.point3D_id if p.has_point3D() else -1 for p in image.points2D])
        for number, image in placed.items()
    }
    total = joined = 0
    with pycolmap.Database.open(database) as db:
        for pair, geometry in zip(*db.read_two_view_geometries(), strict=True):
            a, b = pycolmap.pair_id_to_image_pair(pair)
            matches = np.asarray(geometry.inlier_matches, dtype=np.int64).reshape(-1, 2)
            if a in placed and b in placed and len(matches):
                first, second = point_of[a][matches[:, 0]], point_of[b][matches[:, 1]]
                total += len(matches)
                joined += int(((first == second) & (first >= 0)).sum())
    return joined / total if total >= _MIN_MATCHES else None


def _refine_near(model: Any, positions: dict[int, Any], seed: int) -> None:
    """Run a bundle adjustment with the given positions as priors, in place."""
    from walltopo.geometry.colmap import pycolmap

    options = pycolmap.BundleAdjustmentOptions()
    options.refine_extra_params = not keeps_lens(
        camera.model.name for camera in model.cameras.values()
    )
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = 1.0
    options.ceres.solver_options.num_threads = 1  # bit-identical
    prior_options = pycolmap.PosePriorBundleAdjustmentOptions()
    prior_options.alignment_ransac.random_seed = seed
    prior_options.ceres.prior_position_loss_function_type = pycolmap.LossFunctionType.CAUCHY
    centres = np.array(list(positions.values()))
    spread = max(_POSITION_SHARE * float(np.linalg.norm(np.ptp(centres, axis=0))), 1e-9)
    config = pycolmap.BundleAdjustmentConfig()
    priors = []
    for number in sorted(int(k) for k in model.reg_image_ids()):
        config.add_image(number)
        if number in positions:
            prior = pycolmap.PosePrior()
            prior.corr_data_id = model.images[number].data_id
            prior.position = positions[number]
            prior.position_covariance = spread**2 * np.eye(3)
            prior.coordinate_system = pycolmap.PosePriorCoordinateSystem.CARTESIAN
            priors.append(prior)
    pycolmap.create_pose_prior_bundle_adjuster(
        options, prior_options, config, priors, model
    ).solve()
    model.update_point_3d_errors()


def _register_others(
    model: Any,
    database: Path,
    job: ColmapJob,
    task: MapTask,
    options: Any,
    event: Callable[..., None],
) -> Any:
    """Return the model with the photos that have no usable pose, registered as ever."""
    from walltopo.geometry.colmap import pycolmap

    start = Path(task.output) / "posed"
    start.mkdir(exist_ok=True)
    model.write(start)
    chosen = deepcopy(options)
    chosen.fix_existing_frames = True
    chosen.multiple_models = False
    chosen.load_all_images = True
    event(step="register", total=task.expected - model.num_reg_images())
    output = Path(task.output) / "continued"
    output.mkdir(exist_ok=True)
    found = pycolmap.incremental_mapping(database, job.image_root, output, chosen, input_path=start)
    models = list(found.values())
    grown = max(models, key=lambda one: one.num_reg_images(), default=model)
    return grown if grown.num_reg_images() > model.num_reg_images() else model

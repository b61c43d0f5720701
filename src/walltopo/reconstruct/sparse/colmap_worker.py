"""Call COLMAP in a child process: features, matches, mapping.

COLMAP needs a process of its own because it aborts on a failed internal check, blocks Ctrl-C and
logs to stderr. The only caller is `jobs.run_worker`. The process reads a `ColmapJob` (JSON) from
stdin and writes events, lines that begin with `EVENT`, between COLMAP's log lines.
"""

from __future__ import annotations

import json
import shutil
import statistics
import sys
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core import WalltopoError
from walltopo.core.children import end_with_parent
from walltopo.reconstruct.sparse.jobs import (
    CameraEntry,
    ColmapJob,
    ImageEntry,
    KnownFeatures,
    MapTask,
    Pairing,
)
from walltopo.reconstruct.sparse.models import join_models
from walltopo.reconstruct.sparse.pairs import choose_pairs, in_tiles
from walltopo.reconstruct.sparse.posed import keeps_lens, start_from_poses
from walltopo.reconstruct.sparse.stickers import add_stickers

EVENT = "@walltopo "
_REFINE_ITERATIONS = 40
_GROWTH = 1.4
_MIN_ERROR_PX = 0.05
# Half of COLMAP's limits (30 and 100): on two generated walls, the first alone places a photo more,
# and joins others wrongly, which `drop_barely_linked` finds.
_TENTATIVE_POINTS, _TENTATIVE_FIRST_POINTS = 15, 50
_BLOCK = 100  # pairs per progress line; at most this many are lost by a kill


def main() -> int:
    """Run the job on stdin; return 0, or 1 after an `error` event."""
    job = msgspec.json.decode(sys.stdin.readline(), type=ColmapJob)
    end_with_parent()
    try:
        _run_job(job)
    except (WalltopoError, RuntimeError, ValueError, OSError) as error:
        _write_event(error=str(error), kind=type(error).__name__)
        return 1
    return 0


def _write_event(**fields: Any) -> None:
    sys.stdout.write(EVENT + json.dumps(fields) + "\n")
    sys.stdout.flush()


def _run_job(job: ColmapJob) -> None:
    from walltopo.geometry.colmap import pycolmap

    database = Path(job.database)
    database.parent.mkdir(parents=True, exist_ok=True)
    pycolmap.set_random_seed(job.seed)
    register_images(database, job.cameras, job.images)
    _adopt_features(database, job)
    if job.pairing is not None:
        _extract(database, job)
        _match(database, job, job.pairing)
    if job.pairing is not None or job.learned is not None:
        _verify(database, job, add_stickers(database, job))
    if job.learned is not None:
        from walltopo.reconstruct.sparse.learned_features import add_learned

        _verify(database, job, add_learned(database, job, job.learned, _write_event))
    if job.map is not None:
        _map_photos(database, job, job.map)


def register_images(
    database: Path, cameras: Sequence[CameraEntry], images: Sequence[ImageEntry]
) -> None:
    """Write cameras and images before any feature, so that ids do not depend on thread timing.

    `images[k]` gets image id k + 1; `images[k].camera` is an index into `cameras`.
    """
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        if db.num_images() == len(images):
            return
        db.clear_all_tables()
        for number, entry in enumerate(cameras, start=1):
            camera = pycolmap.Camera(
                model=entry.model,
                width=entry.width,
                height=entry.height,
                params=list(entry.params),
            )
            camera.camera_id = number
            camera.has_prior_focal_length = entry.prior
            db.write_camera(camera, use_camera_id=True)
            rig = pycolmap.Rig(rig_id=number)
            rig.add_ref_sensor(camera.sensor_id)
            db.write_rig(rig, use_rig_id=True)
        for number, photo in enumerate(images, start=1):
            image = pycolmap.Image(name=photo.name, camera_id=photo.camera + 1)
            image.image_id = number
            db.write_image(image, use_image_id=True)
            frame = pycolmap.Frame(frame_id=number, rig_id=photo.camera + 1)
            frame.add_data_id(image.data_id)
            db.write_frame(frame, use_frame_id=True)


def _adopt_features(database: Path, job: ColmapJob) -> None:
    """Copy features that an earlier run found in the same photos with the same settings."""
    from walltopo.geometry.colmap import pycolmap

    source = job.known_features
    if source is None or not Path(source.database).is_file():
        return
    with (
        pycolmap.Database.open(database) as db,
        pycolmap.Database.open(source.database) as known,
    ):
        by_name = {str(image.name): image.image_id for image in known.read_all_images()}
        for number, entry in enumerate(job.images, start=1):
            old = by_name.get(source.names.get(entry.name, ""))
            if old is None or not known.exists_descriptors(old) or db.exists_descriptors(number):
                continue
            db.write_keypoints(number, known.read_keypoints(old))
            db.write_descriptors(number, known.read_descriptors(old))
        if source.matches:
            _adopt_matches(
                db, known, {by_name[old]: here for here, old in _known_images(job, source)}
            )


def _known_images(job: ColmapJob, source: KnownFeatures) -> list[tuple[int, str]]:
    """Return the image id here and the earlier image name of the photos with known features."""
    return [
        (number, source.names[entry.name])
        for number, entry in enumerate(job.images, start=1)
        if entry.name in source.names
    ]


def _adopt_matches(db: Any, known: Any, here: Mapping[int, int]) -> None:
    """Copy matches and two-view geometries; `here` maps earlier image ids to present ones."""
    from walltopo.geometry.colmap import pycolmap

    for pair, matches in zip(*known.read_all_matches(), strict=True):
        a, b = pycolmap.pair_id_to_image_pair(pair)
        if a in here and b in here and not db.exists_matches(here[a], here[b]):
            db.write_matches(here[a], here[b], matches)
            if known.exists_two_view_geometry(a, b):
                geometry = known.read_two_view_geometry(a, b)
                db.write_two_view_geometry(here[a], here[b], geometry)


def _extract(database: Path, job: ColmapJob) -> None:
    """Extract SIFT features of the photos that have none yet."""
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        missing = [
            entry.name
            for number, entry in enumerate(job.images, start=1)
            if not (db.exists_keypoints(number) and db.exists_descriptors(number))
        ]
    _write_event(step="features", total=len(missing))
    if not missing:
        return
    options = pycolmap.FeatureExtractionOptions()
    options.use_gpu = False
    options.num_threads = job.threads
    options.sift.max_num_features = job.sift.max_features
    options.sift.first_octave = job.sift.first_octave
    masks = Path(job.masks)
    masked = [name for name in missing if job.masks and (masks / f"{name}.png").is_file()]
    unmasked = [name for name in missing if name not in masked]
    # COLMAP skips a photo without a mask if it is given a folder of masks.
    for names, folder in ((unmasked, ""), (masked, job.masks)):
        if names:
            reader = pycolmap.ImageReaderOptions()
            reader.mask_path = folder
            pycolmap.extract_features(
                database,
                job.image_root,
                names,
                reader_options=reader,
                extraction_options=options,
                device=pycolmap.Device.cpu,
            )


def _match(database: Path, job: ColmapJob, pairing: Pairing) -> None:
    """Match the chosen pairs of photos that are not matched yet."""
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        wanted = choose_pairs(db, pairing, job.seed)
        done = {
            (a, b)
            for a, b in wanted
            if db.exists_matches(a, b) and db.exists_two_view_geometry(a, b)
        }
    pairs = in_tiles([pair for pair in wanted if pair not in done])
    _write_event(step="matches", total=len(pairs), block=_BLOCK)
    if not pairs:
        return
    matching = pycolmap.FeatureMatchingOptions()
    matching.use_gpu = False
    matching.num_threads = job.threads
    pair_options = pycolmap.ImportedPairingOptions()
    pair_options.block_size = _BLOCK
    with _pair_list(database, job, pairs) as listing:
        pair_options.match_list_path = listing
        pycolmap.match_image_pairs(
            database, matching, pair_options, _verification(job), device=pycolmap.Device.cpu
        )


def _verify(database: Path, job: ColmapJob, pairs: Sequence[tuple[int, int]]) -> None:
    """Keep the matches of the pairs that are inliers of a two-view geometry."""
    from walltopo.geometry.colmap import pycolmap

    if not pairs:
        return
    with _pair_list(database, job, pairs) as listing:
        pycolmap.verify_matches(database, listing, _verification(job))


def _verification(job: ColmapJob) -> Any:
    """Return the `pycolmap.TwoViewGeometryOptions` of a job."""
    from walltopo.geometry.colmap import pycolmap

    options = pycolmap.TwoViewGeometryOptions()
    options.ransac.random_seed = job.seed
    options.min_num_inliers = job.min_matches
    return options


@contextmanager
def _pair_list(database: Path, job: ColmapJob, pairs: Sequence[tuple[int, int]]) -> Iterator[Path]:
    """Write the pairs to a file of image names that exists during the block."""
    names = [entry.name for entry in job.images]
    listing = database.with_suffix(".pairs.txt")
    listing.write_text("".join(f"{names[a - 1]} {names[b - 1]}\n" for a, b in pairs), "utf-8")
    yield listing
    listing.unlink()


def _map_photos(database: Path, job: ColmapJob, task: MapTask) -> None:
    """Map the photos, join and refine the models, and write the best one."""
    output = Path(task.output)
    shutil.rmtree(output, ignore_errors=True)
    output.mkdir(parents=True)
    if task.focal:
        _guess_focals(database, job, task.focal)
    options = _mapper_options(job, task)
    if task.posed:
        found = start_from_poses(database, job, task, options, _write_event)
        if found is None:
            _write_event(models={}, best="", contradicts=True)
            return
        models = found
    else:
        models = _run_mapper(database, job, task, options)
    sizes = {str(key): model.num_reg_images() for key, model in models.items()}
    best = max(models, key=lambda key: (models[key].num_reg_images(), -key), default=None)
    if best is None:
        _write_event(models=sizes, best="")
        return
    # COLMAP writes a continued model to the output folder itself.
    place = output if task.reference else output / str(best)
    model = models[best]
    if len(models) > 1 and not task.reference:
        model = join_models(models, database, Path(job.image_root), place, options) or model
    _write_event(step="refine", total=1)
    refine(model, set(task.held_images), set(task.constant_cameras))
    model.write(place)
    _write_event(models=sizes, best=str(place))


def _guess_focals(database: Path, job: ColmapJob, share: float) -> None:
    """Set the focal length of the cameras that lack one to a share of the longer side."""
    from walltopo.geometry.colmap import pycolmap

    with pycolmap.Database.open(database) as db:
        for number, entry in enumerate(job.cameras, start=1):
            if not entry.prior:
                camera = db.read_camera(number)
                camera.params = [share * max(entry.width, entry.height), *entry.params[1:]]
                db.update_camera(camera)


def _mapper_options(job: ColmapJob, task: MapTask) -> Any:
    """Return the `pycolmap.IncrementalPipelineOptions` of a mapping."""
    from walltopo.geometry.colmap import pycolmap

    options = pycolmap.IncrementalPipelineOptions()
    # Sums over several threads differ in the last bits, and mapping amplifies the differences. One
    # thread makes the model of a resumed scan identical.
    options.num_threads = 1
    options.random_seed = job.seed
    options.mapper.num_threads = 1
    options.mapper.random_seed = job.seed
    options.min_num_matches = job.min_matches
    options.min_model_size = 3
    options.ba_min_num_residuals_for_cpu_multi_threading = 2**31 - 1
    # Global bundle adjustment runs after this growth (COLMAP: 1.1). `refine` runs a final one, and
    # on synthetic gyms the poses were the same.
    options.ba_global_frames_ratio = options.ba_global_points_ratio = _GROWTH
    if task.tentative:
        options.mapper.abs_pose_min_num_inliers = _TENTATIVE_POINTS
        options.mapper.init_min_num_inliers = _TENTATIVE_FIRST_POINTS
    options.image_names = list(task.only)
    if task.reference:
        # The mapper must also load the reference's photos that have no match.
        options.load_all_images = True
        options.fix_existing_frames = True
        options.constant_cameras = set(task.constant_cameras)
        options.multiple_models = False
    return options


def _run_mapper(database: Path, job: ColmapJob, task: MapTask, options: Any) -> dict[int, Any]:
    """Run the mapper; return each `pycolmap.Reconstruction` by its number."""
    from walltopo.geometry.colmap import pycolmap

    _write_event(step="register", total=task.expected)
    return dict(
        pycolmap.incremental_mapping(
            database, job.image_root, task.output, options, input_path=task.reference
        )
    )


def refine(model: Any, held_images: set[int], held_cameras: set[int]) -> None:
    """Run a final bundle adjustment with a Cauchy loss, in place.

    Mapping minimises squared errors, and SIFT's errors are heavy-tailed: this bends the model by
    one or two millimetres over a wall of ten metres. The scale of the loss is the robust standard
    deviation of the model's own errors, so it needs no tuning.

    Parameters
    ----------
    model : `pycolmap.Reconstruction`.
    held_images, held_cameras : ids of the images and cameras whose poses and intrinsics stay fixed.
    """
    from walltopo.geometry.colmap import pycolmap

    options = pycolmap.BundleAdjustmentOptions()
    options.ceres.loss_function_type = pycolmap.LossFunctionType.CAUCHY
    options.ceres.loss_function_scale = max(_error_scale(model), _MIN_ERROR_PX)
    options.ceres.solver_options.max_num_iterations = _REFINE_ITERATIONS
    changing = [camera for number, camera in model.cameras.items() if number not in held_cameras]
    options.refine_extra_params = not keeps_lens(camera.model.name for camera in changing)
    options.ceres.solver_options.num_threads = 1  # bit-identical
    config = pycolmap.BundleAdjustmentConfig()
    for number in sorted(int(k) for k in model.reg_image_ids()):
        config.add_image(number)
        if number in held_images:
            config.set_constant_rig_from_world_pose(model.images[number].frame_id)
    for number in sorted(held_cameras):
        config.set_constant_cam_intrinsics(number)
    if not held_images:
        config.fix_gauge(pycolmap.BundleAdjustmentGauge.TWO_CAMS_FROM_WORLD)
    pycolmap.create_default_bundle_adjuster(options, config, model).solve()
    model.update_point_3d_errors()


def _error_scale(model: Any) -> float:
    """Return the robust standard deviation (per coordinate, px) of the points' mean errors."""
    errors = [point.error for point in model.points3D.values()]
    # The median of a Rayleigh distribution is 1.1774 standard deviations of one coordinate.
    return statistics.median(errors) / 1.1774 if errors else 0.0


if __name__ == "__main__":
    sys.exit(main())

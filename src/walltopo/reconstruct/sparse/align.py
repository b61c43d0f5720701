"""Register new photos into the frame of a finished scan.

The new photos are matched among themselves and against the most similar photos of the reference.
`constrained` continues the reference's model with all its poses and intrinsics held constant, so
only new cameras and points move. (Points seen by both stay free; the reference's rays constrain
them.) `rigid`, for comparison, maps the new photos alone and fits one similarity through the points
that both models share. Changed parts of the wall do not match, so they have no influence. Finally
the reference's photos are dropped: the result is the new photos in the reference's frame. The
reference's folder is never modified.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, StageError
from walltopo.geometry.similarity import fit_similarity_robust
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.attempts import (
    Attempt,
    best_attempt,
    camera_centres,
    describe_model,
    why_unregistered,
)
from walltopo.reconstruct.sparse.feature_cache import known_features
from walltopo.reconstruct.sparse.jobs import (
    CameraEntry,
    ColmapJob,
    ImageEntry,
    KnownFeatures,
    MapTask,
    camera_entries,
    features_job,
    mapping_job,
    photo_ids,
    run_worker,
    write_masks,
)
from walltopo.reconstruct.sparse.lookalikes import are_observed
from walltopo.reconstruct.sparse.models import KeptImage, match_keypoints, rebuild
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel, open_model
from walltopo.scans.folder import ScanFolder, world_frame
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoSet
from walltopo.scans.scale import Aligned, Frame, Scale

Floats = NDArray[np.float64]

_NEW, _REFERENCE = "new", "reference"  # subfolders, because file names may be equal
_MAX_MOVED = 1e-9  # maximum change of a reference pose or parameter
_MIN_SHARE = 0.3  # share of the new photos that must register
_MIN_SHARED_POINTS = 30
_RIGID_TOLERANCE = 0.01  # share of the extent of the reference's cameras


@dataclass(frozen=True, eq=False)
class _Reference:
    """A finished scan that the new photos are aligned to."""

    scan: ScanFolder
    model: Any
    images: tuple[Any, ...]  # registered, sorted by name
    frame: Frame


def align_to_reference(
    folder: PhotoSet, photos: Sequence[Photo], settings: SparseSettings, context: Context
) -> tuple[SparseModel, Aligned | None, Metrics]:
    """Map new photos into the frame of `settings.reference`.

    Metrics: those of `map_photos`, align, reference_moved (largest change of any number in the
    reference's poses and intrinsics), shared_points (points seen by new and reference photos).

    Raises
    ------
    InputError : the reference is not a finished scan, or is the scan itself.
    StageError : the photos do not show the reference's wall.
    """
    reference = _open_reference(folder, settings)
    job = _update_job(folder, photos, reference, settings, context.cache)
    both = {_NEW: folder, _REFERENCE: PhotoSet(reference.scan.photos)}
    job = replace(job, masks=write_masks(both, context.scratch / "masks"))
    align = _map_into_reference if settings.align == "constrained" else _fit_to_reference

    def map_job(job: ColmapJob) -> tuple[_Update | None, dict[str, Floats]]:
        update = align(photos, reference, job, context)
        return update, _registered_centres(update)

    names = [f"{_NEW}/{photo.name}" for photo in photos]

    def is_connected(update: _Update | None, known: Collection[str]) -> bool:
        # `are_connected` is not needed, because the reference's cameras are fixed.
        photos = {name.removeprefix(f"{_NEW}/") for name in known}
        return update is not None and are_observed(update.model, photos)

    attempt = best_attempt(
        job, settings, folder.folder, context.progress, map_job, names, is_connected
    )
    update, registered = attempt.result, len(attempt.registered)
    if update is None or registered < max(2, _MIN_SHARE * len(photos)):
        raise StageError(_low_overlap_message(registered, len(photos), reference))
    model, moved, shared = update.model, update.moved, update.shared_points
    reasons = _reasons(photos, attempt)
    made = context.scratch / "sparse"
    made.mkdir()
    model.write(made)
    for name, reason in reasons.items():
        context.progress.note(f"{name} not registered: {reason}")
    aligned = Aligned(
        reference=str(reference.scan.root),
        align=settings.align,
        reference_moved=moved,
        shared_points=shared,
        frame=reference.frame,
        reference_frame=world_frame(reference.scan),
    )
    figures = {
        **describe_model(model, len(photos)),
        "unregistered": reasons,
        "align": settings.align,
        "reference_moved": moved,
        "shared_points": shared,
        "means": attempt.strategy,
        "tried": list(attempt.tried),
    }
    return SparseModel(made), aligned, figures


@dataclass(frozen=True, eq=False)
class _Update:
    """New photos registered in the reference's frame.

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of the new photos alone.
    moved : largest change of any number in the reference's poses and intrinsics.
    shared_points : number of points seen by both new and reference photos.
    """

    model: Any
    moved: float
    shared_points: int


def _registered_centres(update: _Update | None) -> dict[str, Floats]:
    """Return the camera centres of an update, keyed by the image names of the job."""
    if update is None:
        return {}
    return {f"{_NEW}/{name}": at for name, at in camera_centres(update.model).items()}


def _open_reference(photos: PhotoSet, settings: SparseSettings) -> _Reference:
    """Open and check the reference scan; raise InputError if it is unusable."""
    other = ScanFolder(settings.reference)
    if other.photos.resolve() == photos.folder.resolve():
        raise InputError(f"{other.root}: a scan cannot be its own reference")
    if not other.root.is_dir():
        raise InputError(f"sparse.reference: {other.root}: no such folder")
    try:
        model = open_model(other.sparse)
    except InputError as error:
        raise InputError(
            f"sparse.reference: {other.root} has no cameras ({error.message})",
            "Finish its scan first (`walltopo scan`), at least to the stage `scale`.",
        ) from error
    images = sorted((i for i in model.images.values() if i.has_pose), key=lambda i: str(i.name))
    if len(images) < 2:
        raise InputError(f"sparse.reference: {other.root} has {len(images)} registered photos")
    missing = [str(i.name) for i in images if not (other.photos / str(i.name)).is_file()]
    if missing:
        raise InputError(
            f"sparse.reference: {other.photos / missing[0]} is missing: the reference's photos "
            "are needed to match against"
        )
    return _Reference(other, model, tuple(images), Scale.load(other.scale).frame)


def _show_folder(place: Path, folder: Path) -> None:
    """Make a folder appear at another place: by a link, or by a copy where links are forbidden."""
    if place.is_symlink():
        place.unlink()
    elif place.exists():
        shutil.rmtree(place)
    try:
        place.symlink_to(folder, target_is_directory=True)
    except OSError:  # Windows allows links to developers only
        shutil.copytree(folder, place)


def _update_job(
    folder: PhotoSet,
    photos: Sequence[Photo],
    reference: _Reference,
    settings: SparseSettings,
    cache: Path,
) -> ColmapJob:
    """Return the job for features and matches; images 1 to n are new, n + 1 on the reference's."""
    root = cache / "both"
    root.mkdir(parents=True, exist_ok=True)
    for name, target in ((_NEW, folder.folder), (_REFERENCE, reference.scan.photos)):
        _show_folder(root / name, target.resolve())
    cameras, indices = camera_entries(photos)
    images = [
        ImageEntry(f"{_NEW}/{photo.name}", index)
        for photo, index in zip(photos, indices, strict=True)
    ]
    places = {old: len(cameras) + k for k, old in enumerate(sorted(reference.model.cameras))}
    for old in sorted(reference.model.cameras):
        camera = reference.model.cameras[old]
        params = tuple(float(value) for value in camera.params)
        width, height = int(camera.width), int(camera.height)
        cameras.append(CameraEntry(camera.model.name, width, height, params, True))
    images += [
        ImageEntry(f"{_REFERENCE}/{image.name}", places[image.camera_id])
        for image in reference.images
    ]
    new, old_ids = photo_ids(photos), range(len(photos) + 1, len(images) + 1)
    database = cache / "aligned-features" / "features.db"
    job = features_job(database, root, settings, cameras, images, new, old_ids)
    known = known_features(job, reference.scan.work, reference.scan.photos)
    if known is None:
        return job
    names = {f"{_REFERENCE}/{image.name}": str(image.name) for image in reference.images}
    # SQLite writes files beside a database when it opens it, and the reference must not change.
    copy = cache / "reference-features.db"
    shutil.copyfile(known, copy)
    return replace(job, known_features=KnownFeatures(str(copy), names))


def _run_mapper(job: ColmapJob, task: MapTask, context: Context) -> Any | None:
    """Map the job's features and matches; return the best model or None."""
    result = run_worker(mapping_job(job, task), context.progress)
    return open_model(Path(result.best)) if result.best else None


def _new_count(job: ColmapJob) -> int:
    """Return the number of new photos of a job; they come first."""
    return sum(entry.name.startswith(f"{_NEW}/") for entry in job.images)


def _output(context: Context) -> str:
    return str(context.cache / "mapping")


def _map_into_reference(
    photos: Sequence[Photo], reference: _Reference, job: ColmapJob, context: Context
) -> _Update | None:
    """Map new cameras into the fixed reference; return None if no camera could be registered."""
    known = _reference_for_mapper(reference, job)
    start = context.cache / "reference-model"
    shutil.rmtree(start, ignore_errors=True)
    start.mkdir(parents=True)
    known.write(start)
    task = MapTask(
        _output(context),
        len(photos),
        reference=str(start),
        constant_cameras=tuple(sorted(known.cameras)),
        held_images=tuple(sorted(known.images)),
    )
    model = _run_mapper(job, task, context)
    if model is None:
        return None
    moved = _max_change(known, model)
    if moved > _MAX_MOVED:
        raise StageError(
            f"the reference's cameras moved by {moved:.1e} while they were to be held: "
            "a defect of this COLMAP; use sparse.align=rigid"
        )
    new_ids = set(photo_ids(photos))
    shared = sum(
        1
        for point in model.points3D.values()
        if {e.image_id in new_ids for e in point.track.elements} == {True, False}
    )
    return _Update(_new_part(model, new_ids), moved, shared)


def _reference_for_mapper(reference: _Reference, job: ColmapJob) -> Any:
    """Return the reference's model with the job's image ids and keypoints."""
    from walltopo.geometry.colmap import pycolmap

    first = 1 + _new_count(job)
    kept: list[KeptImage] = []
    with pycolmap.Database.open(job.database) as db:
        for number, image in enumerate(reference.images, start=first):
            found = np.asarray(db.read_keypoints(number), dtype=np.float64)[:, :2]
            old = np.array([point.xy for point in image.points2D]).reshape(-1, 2)
            wanted = np.array([point.has_point3D() for point in image.points2D], dtype=np.bool_)
            entry = job.images[number - 1]
            index = match_keypoints(old, found, wanted)
            kept.append(KeptImage(image, number, entry.name, entry.camera + 1, found, index))
    cameras = {entry.source.camera_id: entry.camera_id for entry in kept}
    return rebuild(reference.model, kept, cameras)


def _fit_to_reference(
    photos: Sequence[Photo], reference: _Reference, job: ColmapJob, context: Context
) -> _Update | None:
    """Map the new photos alone, then fit one similarity through the points that both models share.

    Return None if there is no model or too few shared points.
    """
    from walltopo.geometry.colmap import pycolmap

    count = len(photos)
    names = tuple(entry.name for entry in job.images[:count])
    alone = _run_mapper(job, MapTask(_output(context), count, only=names), context)
    if alone is None:
        return None
    known = _reference_for_mapper(reference, job)
    source, target = _shared_points(alone, known, job)
    centres = np.array([image.projection_center() for image in known.images.values()])
    tolerance = _RIGID_TOLERANCE * float(np.ptp(centres, axis=0).max())
    try:
        fit, good = fit_similarity_robust(source, target, tolerance, job.seed, rounds=2000)
    except InputError:
        return None
    if good.sum() < _MIN_SHARED_POINTS:
        return None
    alone.transform(pycolmap.Sim3d(fit.scale, pycolmap.Rotation3d(fit.rotation), fit.translation))
    return _Update(_new_part(alone, set(photo_ids(photos))), 0.0, int(good.sum()))


def _shared_points(alone: Any, known: Any, job: ColmapJob) -> tuple[Floats, Floats]:
    """Return the points (n, 3) of the new model and of the reference that verified matches
    connect."""
    from walltopo.geometry.colmap import pycolmap

    count = _new_count(job)
    pairs: set[tuple[int, int]] = set()
    with pycolmap.Database.open(job.database) as db:
        for pair, geometry in zip(*db.read_two_view_geometries(), strict=True):
            a, b = pycolmap.pair_id_to_image_pair(pair)
            if not (a <= count < b) or a not in alone.images or b not in known.images:
                continue
            new, old = alone.images[a].points2D, known.images[b].points2D
            for i, k in np.asarray(geometry.inlier_matches).tolist():
                if new[i].has_point3D() and old[k].has_point3D():
                    pairs.add((new[i].point3D_id, old[k].point3D_id))
    ordered = sorted(pairs)
    source = np.array([alone.points3D[a].xyz for a, _ in ordered]).reshape(-1, 3)
    target = np.array([known.points3D[b].xyz for _, b in ordered]).reshape(-1, 3)
    return source, target


def _new_part(model: Any, new_ids: set[int]) -> Any:
    """Return the model without the reference's photos, with the image names of the new scan."""
    kept = []
    for image in sorted(model.images.values(), key=lambda image: image.image_id):
        if image.image_id in new_ids and image.has_pose:
            xy = np.array([point.xy for point in image.points2D]).reshape(-1, 2)
            name = str(image.name).removeprefix(f"{_NEW}/")
            index = np.arange(len(xy))
            kept.append(KeptImage(image, image.image_id, name, image.camera_id, xy, index))
    used = {entry.camera_id for entry in kept}
    return rebuild(model, kept, {number: number for number in used})


def _max_change(before: Any, after: Any) -> float:
    """Return the largest change of any number in the poses and intrinsics of `before`."""
    worst = 0.0
    for number, image in before.images.items():
        if number not in after.images or not after.images[number].has_pose:
            return float("inf")
        now = after.images[number].cam_from_world().matrix()
        worst = max(worst, float(np.abs(now - image.cam_from_world().matrix()).max()))
    for number, camera in before.cameras.items():
        change = np.abs(np.asarray(after.cameras[number].params) - np.asarray(camera.params))
        worst = max(worst, float(change.max()))
    return worst


def _reasons(photos: Sequence[Photo], attempt: Attempt[_Update | None]) -> dict[str, str]:
    """Return why each missing photo was not registered, by photo name."""
    named = {photo.name: f"{_NEW}/{photo.name}" for photo in photos}
    missing = {name: named[name] for name in named if named[name] not in attempt.registered}
    return why_unregistered(Path(attempt.job.database), missing, {})


def _low_overlap_message(registered: int, photos: int, reference: _Reference) -> str:
    return (
        f"{registered} of the {photos} new photos could be registered into the reference "
        f"{reference.scan.root}: they show another wall, overlap too little with its photos, or "
        "nothing on the wall stayed the same. Both scans are as they were"
    )

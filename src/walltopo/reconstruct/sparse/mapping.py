"""Run the sparse stage: photos to cameras and points by COLMAP's incremental mapping.

The model's scale and direction are arbitrary unless a reference is given.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, StageError, View
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.align import align_to_reference
from walltopo.reconstruct.sparse.attempts import (
    Attempt,
    best_attempt,
    bridging_pair,
    camera_centres,
    describe_model,
    other_models,
    why_unregistered,
)
from walltopo.reconstruct.sparse.feature_cache import database_of
from walltopo.reconstruct.sparse.focal_guesses import (
    Mapped,
    best_mapping,
    focals_of,
    has_doubtful_lens,
)
from walltopo.reconstruct.sparse.given_poses import (
    contradiction_error,
    into_frame_of_poses,
    posed_cameras,
    posed_views,
    write_posed_model,
)
from walltopo.reconstruct.sparse.jobs import (
    ColmapJob,
    ImageEntry,
    MappingResult,
    MapTask,
    camera_entries,
    features_job,
    mapping_job,
    photo_ids,
    run_worker,
    write_masks,
)
from walltopo.reconstruct.sparse.larger_network import larger_network_files
from walltopo.reconstruct.sparse.lookalikes import are_connected, are_observed
from walltopo.reconstruct.sparse.pose_check import poses_contradict
from walltopo.reconstruct.sparse.weak_photos import (
    check_strength,
    drop_barely_linked,
    drop_weak_photos,
)
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel, open_model
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList, PhotoSet
from walltopo.scans.poses import GivenPoses, PosesFit
from walltopo.scans.scale import Aligned

Floats = NDArray[np.float64]


def map_photos(
    folder: PhotoSet,
    photo_list: PhotoList,
    given: GivenPoses | None,
    settings: SparseSettings,
    context: Context,
) -> tuple[SparseModel, Aligned | None, PosesFit | None, Metrics]:
    """Register the photos; with `settings.reference`, in the frame of that finished scan.

    Metrics: photos, registered, points, reprojection_px, track_length, focal_px, unregistered (name
    to reason), means (the strategy of the best attempt), tried (all that ran), own_points (of the
    median photo); with given poses, instead of the last, poses_median and poses_median_deg (see
    `PosesFit`).

    Parameters
    ----------
    given : poses from which the mapping starts; the result is in their frame.

    Raises
    ------
    InputError : fewer than two photos, a missing photo file, an unusable reference, or poses that
        do not fit the photos.
    StageError : COLMAP failed, no two photos could be registered together, or the model is weak and
        `settings.accept_weak` is false.
    """
    photos = _photos(folder, photo_list)
    if settings.reference:
        model, aligned, figures = align_to_reference(folder, photos, settings, context)
        return model, aligned, None, figures
    views = {} if given is None else posed_views(given, photos)
    if given is not None and poses_contradict(
        folder, photos, views, settings, context.scratch, context.progress
    ):
        raise contradiction_error(given)
    attempt, dropped = _reconstruct(folder, photos, given, views, settings, context)
    result = attempt.result
    if not result.models:
        raise _not_registered(len(photos)) if given is None else contradiction_error(given)
    best = Path(result.best)
    others = other_models(best.parent, best)
    _note_groups(others, attempt, context)
    missing = {photo.name: photo.name for photo in photos if photo.name not in attempt.registered}
    elsewhere = {name: len(group) for group in others for name in group}
    reasons = why_unregistered(Path(attempt.job.database), missing, elsewhere)
    reasons |= {name: why for name, why in dropped.items() if name in missing}
    for name, reason in reasons.items():
        context.progress.note(f"{name} not registered: {reason}")
    if reasons and settings.features == "auto" and larger_network_files() is None:
        context.progress.note("pip install 'walltopo[features]' may place more of these photos")
    made = context.scratch / "sparse"
    fit = None
    if given is None:
        shutil.copytree(best, made)
    else:
        fit = _write_in_frame_of_poses(best, made, given, views)
    model = SparseModel(made)
    opened = model.open()
    figures = describe_model(opened, len(photos))
    figures |= {"unregistered": reasons, "means": attempt.strategy, "tried": list(attempt.tried)}
    if given is None:
        figures["own_points"] = check_strength(opened, accept_weak=settings.accept_weak)
    if fit is not None:
        figures |= {"poses_median": fit.median, "poses_median_deg": fit.median_deg}
    return model, None, fit, figures


def _not_registered(photos: int) -> StageError:
    return StageError(
        f"none of the {photos} photos could be registered",
        "They overlap too little. Take sharp photos of one wall that overlap by two thirds, and "
        "move between them.",
    )


def _write_in_frame_of_poses(
    best: Path, made: Path, given: GivenPoses, views: Mapping[str, View]
) -> PosesFit:
    model = open_model(best)
    fit = into_frame_of_poses(model, given, views)
    made.mkdir()
    model.write(made)
    return fit


def _photos(folder: PhotoSet, photo_list: PhotoList) -> list[Photo]:
    """Return the photos sorted by name; raise InputError if fewer than two or a file is missing."""
    photos = sorted(photo_list.photos, key=lambda photo: photo.name)
    if len(photos) < 2:
        raise InputError(f"{len(photos)} photo(s), at least 2 are needed")
    for photo in photos:
        folder.path(photo.name)
    return photos


_MIN_MODEL_POINTS = 30  # cameras with fewer common points are placed by chance


def _reconstruct(
    folder: PhotoSet,
    photos: Sequence[Photo],
    given: GivenPoses | None,
    views: Mapping[str, View],
    settings: SparseSettings,
    context: Context,
) -> tuple[Attempt[MappingResult], dict[str, str]]:
    """Map the photos without a reference; the models are written below `work/`.

    Return the best attempt, and the photos that were dropped from its model, with reasons.

    Parameters
    ----------
    given, views : given poses, and their views by photo name, else None and empty.

    Raises
    ------
    InputError : the poses contradict the photos.
    """
    cameras, indices = posed_cameras(photos, views) if views else camera_entries(photos)
    images = [ImageEntry(photo.name, index) for photo, index in zip(photos, indices, strict=True)]
    database, ids = database_of(context.cache), photo_ids(photos)
    job = features_job(database, folder.folder, settings, cameras, images, ids)
    job = replace(job, masks=write_masks({"": folder}, context.scratch / "masks"))
    posed = ""
    if views:
        posed = write_posed_model(photos, views, cameras, indices, context.scratch / "posed")

    focals = (0.0,) if views else focals_of(job)
    mapper = _Mapper(len(photos), given, posed, context.progress, focals)

    def is_connected(result: MappingResult, known: Collection[str]) -> bool:
        model = open_model(Path(result.best))
        return are_connected(model, known) and are_observed(model, known)

    names = [photo.name for photo in photos]
    attempt = best_attempt(
        job, settings, folder.folder, context.progress, mapper.map_job, names, is_connected
    )
    return attempt, mapper.dropped.get(attempt.result.best, {})


@dataclass
class _Mapper:
    """Maps the features of one attempt after the other.

    Parameters
    ----------
    photos : number of photos.
    given, posed : given poses and the folder of their model, else None and "".
    focals : guesses of the focal length; the one that was right, once enough photos are placed.
    dropped : photos that a model did not hold, with reasons, by the model's folder.
    """

    photos: int
    given: GivenPoses | None
    posed: str
    progress: Progress
    focals: tuple[float, ...]
    dropped: dict[str, dict[str, str]] = field(default_factory=dict[str, dict[str, str]])

    def map_job(self, job: ColmapJob) -> tuple[MappingResult, Mapping[str, Floats]]:
        """Return the best mapping of a job's features, and its camera centres (3,) by photo."""
        best, focal = best_mapping(partial(self._map_from, job), self.focals, self.photos)
        if 2 * len(best.centres) >= self.photos:  # enough to know the lens
            self.focals = (focal,)
        return best.result, best.centres

    def _map_from(self, job: ColmapJob, focal: float) -> Mapped:
        # Mapping runs in its own process: otherwise COLMAP's random state would depend on
        # whether the same process also matched the photos.
        output = Path(job.database).with_name(f"mapping-{focal:g}" if focal else "mapping")
        tentative = job.learned is not None and job.learned.larger
        task = MapTask(str(output), self.photos, posed=self.posed, focal=focal, tentative=tentative)
        result = run_worker(mapping_job(job, task), self.progress)
        if result.contradicts and self.given is not None:
            raise contradiction_error(self.given)
        if not result.best:
            return Mapped(result, {})
        model = open_model(Path(result.best))
        if not self.posed:
            barely = drop_barely_linked(model) if job.learned is not None else {}
            self.dropped[result.best] = dropped = barely | drop_weak_photos(model)
            if dropped:
                model.write(result.best)
        if model.num_points3D() < _MIN_MODEL_POINTS or has_doubtful_lens(model, job):
            return Mapped(MappingResult(), {})
        return Mapped(result, camera_centres(model), model.compute_num_observations())


def _note_groups(
    others: Sequence[set[str]], attempt: Attempt[MappingResult], context: Context
) -> None:
    """Say which groups of photos do not connect, and where one more photo would connect them."""
    kept = attempt.registered.keys()
    apart = [group for group in others if not group & kept]
    for group in sorted(apart, key=lambda names: (-len(names), sorted(names))):
        pair = bridging_pair(Path(attempt.job.database), kept, group)
        where = "" if pair is None else f"; take one between {pair[0]} and {pair[1]}, and add it"
        context.progress.note(
            f"a group of {len(group)} photos does not connect to the other {len(kept)}, "
            f"which are kept{where}"
        )

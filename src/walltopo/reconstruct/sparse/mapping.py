"""The sparse stage: photos to cameras and points, by COLMAP's incremental mapping.

The model's scale and direction are arbitrary unless a reference is given.
"""

from __future__ import annotations

import shutil
from collections.abc import Collection, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, StageError
from walltopo.reconstruct.sparse.align import align_to_reference
from walltopo.reconstruct.sparse.attempts import Attempt, best_attempt, learned_alone
from walltopo.reconstruct.sparse.colmap_process import run_worker
from walltopo.reconstruct.sparse.feature_cache import database_of
from walltopo.reconstruct.sparse.jobs import (
    ImageEntry,
    Job,
    Mapped,
    MapTask,
    camera_entries,
    features_job,
    mapping_job,
    photo_ids,
)
from walltopo.reconstruct.sparse.outcome import (
    camera_centres,
    describe_model,
    hang_together,
    other_models,
    why_unregistered,
)
from walltopo.reconstruct.sparse.settings import SparseSettings
from walltopo.scans.colmap_model import SparseModel, open_model
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import Photo, PhotoList, PhotoSet
from walltopo.scans.scale import Aligned

Floats = NDArray[np.float64]


def map_photos(
    folder: PhotoSet, photo_list: PhotoList, settings: SparseSettings, context: Context
) -> tuple[SparseModel, Aligned | None, Metrics]:
    """Register the photos; with `settings.reference`, in the frame of that finished scan.

    Metrics: photos, registered, points, reprojection_px, track_length, focal_px,
    unregistered (name to reason).

    Raises
    ------
    InputError : no photos, or a reference that cannot be used.
    StageError : COLMAP failed, or no two photos could be put together.
    """
    photos = _photos(folder, photo_list)
    if settings.reference:
        return align_to_reference(folder, photos, settings, context)
    attempt = _reconstruct(folder, photos, settings, context)
    result = attempt.made
    if not result.models:
        raise StageError(
            f"none of the {len(photos)} photos could be put together",
            "They share too little: take photos that overlap by two thirds, of one wall, sharp "
            "and not all from one spot.",
        )
    best = Path(result.best)
    _tell_groups(result, context)
    missing = {photo.name: photo.name for photo in photos if photo.name not in attempt.registered}
    elsewhere = other_models(best.parent, best)
    reasons = why_unregistered(Path(attempt.job.database), missing, elsewhere)
    made = context.scratch / "sparse"
    shutil.copytree(best, made)
    for name, reason in reasons.items():
        context.progress.note(f"{name} not registered: {reason}")
    model = SparseModel(made)
    figures = describe_model(model.open(), len(photos))
    return model, None, {**figures, "unregistered": reasons, "means": attempt.means}


def _photos(folder: PhotoSet, photo_list: PhotoList) -> list[Photo]:
    """The photos, sorted by name; InputError where they are fewer than two or one is missing."""
    photos = sorted(photo_list.photos, key=lambda photo: photo.name)
    if len(photos) < 2:
        raise InputError(f"{len(photos)} photo(s), at least 2 are needed")
    for photo in photos:
        folder.path(photo.name)
    return photos


def _reconstruct(
    folder: PhotoSet, photos: Sequence[Photo], settings: SparseSettings, context: Context
) -> Attempt[Mapped]:
    """Map the photos on their own; models lie below `work/`."""
    cameras, indices = camera_entries(photos)
    images = [ImageEntry(photo.name, index) for photo, index in zip(photos, indices, strict=True)]
    database, ids = database_of(context.cache), photo_ids(photos)
    job = features_job(database, folder.folder, settings, cameras, images, ids)
    if settings.features == "xfeat":
        job = learned_alone(job)

    def mapped(job: Job) -> tuple[Mapped, dict[str, Floats]]:
        # Mapping gets a process of its own: COLMAP's random state would differ between a run that
        # matched photos first and one that found them matched.
        output = str(Path(job.database).with_name("mapping"))
        task = MapTask(output, len(photos))
        result = run_worker(mapping_job(job, task), context.progress)
        return result, camera_centres(open_model(Path(result.best))) if result.best else {}

    def tied(result: Mapped, known: Collection[str]) -> bool:
        return hang_together(open_model(Path(result.best)), known)

    names = [photo.name for photo in photos]
    return best_attempt(job, settings, folder.folder, context.progress, mapped, names, tied)


def _tell_groups(result: Mapped, context: Context) -> None:
    if len(result.models) > 1:
        counts = sorted(result.models.values(), reverse=True)
        context.progress.note(
            f"the photos fall into {len(result.models)} groups that do not connect "
            f"({', '.join(map(str, counts))} photos); the largest is kept"
        )

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
from walltopo.scans.context import Context
from walltopo.scans.model import SparseModel, open_model
from walltopo.scans.photo_list import Photo
from walltopo.scans.photo_set import PhotoSet
from walltopo.sparse.align import align_to_reference
from walltopo.sparse.attempts import Attempt, best_attempt, learned_alone
from walltopo.sparse.colmap_process import run_worker
from walltopo.sparse.contract import Reads, SparseSettings, Writes
from walltopo.sparse.feature_cache import database_of
from walltopo.sparse.job import ImageEntry, Job, Mapped, MapTask
from walltopo.sparse.jobs import (
    camera_entries,
    features_job,
    mapping_job,
    photo_ids,
)
from walltopo.sparse.outcome import (
    camera_centres,
    describe_model,
    other_models,
    why_unregistered,
)
from walltopo.sparse.ties import hang_together

__all__ = ["run"]

Floats = NDArray[np.float64]


def run(reads: Reads, settings: SparseSettings, context: Context) -> Writes:
    """Register the photos; with `settings.reference`, in the frame of that finished scan.

    Metrics: photos, registered, points, reprojection_px, track_length, focal_px,
    unregistered (name to reason).

    Raises
    ------
    InputError : no photos, or a reference that cannot be used.
    StageError : COLMAP failed, or no two photos could be put together.
    """
    photos = _photos(reads)
    if settings.reference:
        return align_to_reference(reads.photos, photos, settings, context)
    attempt = _reconstruct(reads.photos, photos, settings, context)
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
    folder = context.scratch / "sparse"
    shutil.copytree(best, folder)
    for name, reason in reasons.items():
        context.progress.note(f"{name} not registered: {reason}")
    model = SparseModel(folder)
    figures = describe_model(model.open(), len(photos))
    return Writes(model, None, {**figures, "unregistered": reasons, "means": attempt.means})


def _photos(reads: Reads) -> list[Photo]:
    """The photos, sorted by name; InputError where they are fewer than two or one is missing."""
    photos = sorted(reads.photo_list.photos, key=lambda photo: photo.name)
    if len(photos) < 2:
        raise InputError(f"{len(photos)} photo(s), at least 2 are needed")
    for photo in photos:
        reads.photos.path(photo.name)
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

"""Check given poses on a few photos, before the features of all photos are found and matched.

All photos of a large scan take many minutes. A handful shows within seconds that poses belong to
other photos, or that the lens means something else.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace

from walltopo.core import Progress, View
from walltopo.reconstruct.settings import SparseSettings
from walltopo.reconstruct.sparse.given_poses import posed_cameras, write_posed_model
from walltopo.reconstruct.sparse.jobs import (
    ImageEntry,
    MapTask,
    features_job,
    mapping_job,
    photo_ids,
    run_worker,
    write_masks,
)
from walltopo.scans.photos import Photo, PhotoSet

_SAMPLE = 6  # photos
_MIN_PHOTOS = 12  # the whole check of fewer photos takes seconds

# Lower than for all photos, since one wrong pose among six spoils a third of the pairs.
_MIN_EXPLAINED = 0.3


def poses_contradict(
    folder: PhotoSet,
    photos: Sequence[Photo],
    views: Mapping[str, View],
    settings: SparseSettings,
    scratch: Path,
    progress: Progress,
) -> bool:
    """Return whether a few photos that overlap contradict their poses.

    False also if there are too few photos, or if these have too little in common to tell.

    Parameters
    ----------
    views : posed views by photo name.
    scratch : folder for the features of the sample.
    """
    posed = [photo for photo in photos if photo.name in views]
    if len(posed) < _MIN_PHOTOS:
        return False
    # Photos that were taken one after another overlap, whatever their poses say.
    start = (len(posed) - _SAMPLE) // 2
    chosen = posed[start : start + _SAMPLE]
    cameras, indices = posed_cameras(chosen, {photo.name: views[photo.name] for photo in chosen})
    images = [ImageEntry(photo.name, index) for photo, index in zip(chosen, indices, strict=True)]
    place = scratch / "pose-check"
    database = place / "features.db"
    job = features_job(database, folder.folder, settings, cameras, images, photo_ids(chosen))
    job = replace(job, masks=write_masks({"": folder}, place / "masks"))
    run_worker(job, progress)
    model = write_posed_model(chosen, views, cameras, indices, place / "posed")
    task = MapTask(str(place / "mapping"), len(chosen), posed=model, min_explained=_MIN_EXPLAINED)
    return run_worker(mapping_job(job, task), progress).contradicts

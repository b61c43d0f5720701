"""Making jobs for COLMAP's child process."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from msgspec.structs import replace

from walltopo.scans.photo_list import Photo
from walltopo.sparse.contract import SparseSettings
from walltopo.sparse.job import CameraEntry, ImageEntry, Job, MapTask, Pairing, Sift

__all__ = [
    "camera_entries",
    "features_job",
    "mapping_job",
    "photo_ids",
]

_DEFAULT_FOCAL = 1.2  # of the longer side, where EXIF tells none (COLMAP's own default)


def photo_ids(photos: Sequence[Photo]) -> tuple[int, ...]:
    """The image ids of a scan's own photos: they come first in the database."""
    return tuple(range(1, len(photos) + 1))


def camera_entries(photos: Sequence[Photo]) -> tuple[list[CameraEntry], list[int]]:
    """One SIMPLE_RADIAL camera per (size, focal prior), and each photo's index into them."""
    keys: dict[tuple[int, int, float | None], int] = {}
    indices = [
        keys.setdefault((photo.width, photo.height, photo.focal_px), len(keys)) for photo in photos
    ]
    cameras = [
        CameraEntry(
            "SIMPLE_RADIAL",
            width,
            height,
            (focal or _DEFAULT_FOCAL * max(width, height), width / 2, height / 2, 0.0),
            focal is not None,
        )
        for width, height, focal in keys
    ]
    return cameras, indices


def features_job(
    database: Path,
    image_root: Path,
    settings: SparseSettings,
    cameras: Sequence[CameraEntry],
    images: Sequence[ImageEntry],
    new: Sequence[int],
    reference: Sequence[int] = (),
) -> Job:
    """The job that finds and matches features.

    Parameters
    ----------
    new, reference : image ids of the scan's own photos and of the reference's.
    """
    return Job(
        database=str(database),
        image_root=str(image_root),
        threads=settings.threads or -1,
        seed=settings.seed,
        sift=Sift(settings.max_features, settings.first_octave),
        min_matches=settings.min_matches,
        cameras=tuple(cameras),
        images=tuple(images),
        pairing=Pairing(
            tuple(new),
            tuple(reference),
            settings.exhaustive_max,
            settings.sequential,
            settings.retrieved,
            settings.reference_retrieved,
        ),
    )


def mapping_job(job: Job, task: MapTask) -> Job:
    """The job that maps from what another has found and matched, and looks for nothing itself."""
    return replace(job, pairing=None, learned=None, known_features=None, map=task)

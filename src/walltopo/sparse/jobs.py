"""Making jobs for COLMAP's child process, and the feature database that they share.

`work/features/` keeps the feature database, so that a killed run continues with the photos and
pairs that are missing.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import msgspec

from walltopo.core.files import hash_path, read_json, write_json
from walltopo.scans.photo_list import Photo
from walltopo.sparse.contract import SparseSettings
from walltopo.sparse.job import CameraEntry, ImageEntry, Job, Pairing

__all__ = [
    "camera_entries",
    "database_of",
    "features_job",
    "keep_database",
    "known_features",
    "photo_ids",
]

_STAMP = "made-from.json"
_DEFAULT_FOCAL = 1.2  # of the longer side, where EXIF tells none (COLMAP's own default)


def database_of(work: Path) -> Path:
    """The feature database below a scan's `work/`."""
    return work / "features" / "features.db"


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
        max_features=settings.max_features,
        first_octave=settings.first_octave,
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


def keep_database(job: Job, photos: Path) -> None:
    """Drop the feature database unless it was made from these photos with these settings."""
    # As JSON gives it back: lists, where the job has tuples.
    plain = msgspec.json.decode(msgspec.json.encode(job))
    key = {name: plain[name] for name in ("cameras", "images", "min_matches", "seed")}
    key |= _feature_key(job, photos)
    stamp = Path(job.database).parent / _STAMP
    if not (stamp.is_file() and read_json(stamp) == key):
        shutil.rmtree(stamp.parent, ignore_errors=True)
        write_json(stamp, key)


def known_features(job: Job, work: Path, photos: Path) -> Path | None:
    """The feature database of another scan, if it holds what this job would find again.

    Parameters
    ----------
    work, photos : the other scan's folders.
    """
    database = database_of(work)
    stamp = database.parent / _STAMP
    if not (stamp.is_file() and database.is_file()):
        return None
    told, wanted = read_json(stamp), _feature_key(job, photos)
    return database if {name: told.get(name) for name in wanted} == wanted else None


def _feature_key(job: Job, photos: Path) -> dict[str, Any]:
    """What a photo's features follow from."""
    return {
        "max_features": job.max_features,
        "first_octave": job.first_octave,
        "photos": hash_path(photos),
    }

"""Jobs for the child process that calls COLMAP, and the feature database that they share.

`work/features/` keeps the feature database, so that a killed run continues with the photos and
pairs that are missing.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walltopo.core.files import hash_path, read_json, write_json
from walltopo.scans.photo_list import Photo
from walltopo.sparse.contract import SparseSettings

__all__ = ["camera_entries", "database_of", "keep_database", "known_features", "mapping_job"]

_STAMP = "made-from.json"
_DEFAULT_FOCAL = 1.2  # of the longer side, where EXIF tells none (COLMAP's own default)


def database_of(work: Path) -> Path:
    """The feature database below a scan's `work/`."""
    return work / "features" / "features.db"


def camera_entries(
    photos: Sequence[Photo],
) -> tuple[list[dict[str, Any]], list[int]]:
    """One SIMPLE_RADIAL camera per (size, focal prior), and each photo's index into them."""
    keys: dict[tuple[int, int, float | None], int] = {}
    indices = [
        keys.setdefault((photo.width, photo.height, photo.focal_px), len(keys)) for photo in photos
    ]
    cameras = [
        {
            "model": "SIMPLE_RADIAL",
            "width": width,
            "height": height,
            "params": [focal or _DEFAULT_FOCAL * max(width, height), width / 2, height / 2, 0.0],
            "prior": focal is not None,
        }
        for width, height, focal in keys
    ]
    return cameras, indices


def mapping_job(database: Path, image_root: Path, settings: SparseSettings) -> dict[str, Any]:
    """The fields of a worker's job that follow from the settings."""
    return {
        "database": str(database),
        "image_root": str(image_root),
        "threads": settings.threads or -1,
        "seed": settings.seed,
        "max_features": settings.max_features,
        "first_octave": settings.first_octave,
        "min_matches": settings.min_matches,
        "pairing": {
            "new": [],
            "reference": [],
            "exhaustive_max": settings.exhaustive_max,
            "sequential": settings.sequential,
            "retrieved": settings.retrieved,
            "reference_retrieved": settings.reference_retrieved,
        },
    }


def keep_database(job: dict[str, Any], photos: Path) -> None:
    """Drop the feature database unless it was made from these photos with these settings."""
    key = {name: job[name] for name in ("cameras", "images", "min_matches", "seed")}
    key |= _feature_key(job, photos)
    stamp = Path(job["database"]).parent / _STAMP
    if not (stamp.is_file() and read_json(stamp) == key):
        shutil.rmtree(stamp.parent, ignore_errors=True)
        write_json(stamp, key)


def known_features(job: dict[str, Any], work: Path, photos: Path) -> Path | None:
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


def _feature_key(job: dict[str, Any], photos: Path) -> dict[str, Any]:
    """What a photo's features follow from."""
    settings = {name: job[name] for name in ("max_features", "first_octave")}
    return {**settings, "photos": hash_path(photos)}

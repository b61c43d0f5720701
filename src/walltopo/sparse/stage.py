"""The sparse stage: photos to cameras and points, by COLMAP's incremental mapping.

Files: reads `photos/` and `photos.json`; writes `work/sparse` (the model, arbitrary scale and
direction unless a reference is given). `work/features/` keeps the feature database, so that a
killed run continues with the photos and pairs that are missing.
"""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walltopo.core import InputError, Progress, StageError
from walltopo.scans.folder import ScanFolder
from walltopo.core.files import atomic_path, hash_path, read_json, write_json
from walltopo.scans.model import open_model
from walltopo.sparse.colmap_process import check_supported, run_worker
from walltopo.sparse.contract import SparseSettings
from walltopo.sparse.outcome import (
    describe_model,
    other_models,
    registered_names,
    why_unregistered,
)

__all__ = [
    "camera_entries",
    "keep_database",
    "known_features",
    "mapping_job",
    "photo_entries",
    "reconstruct",
    "run",
]

_STAMP = "made-from.json"
_DEFAULT_FOCAL = 1.2  # of the longer side, where EXIF tells none (COLMAP's own default)


def run(scan: ScanFolder, settings: SparseSettings, progress: Progress) -> dict[str, Any]:
    """Register the photos; with `settings.reference`, in the frame of that finished scan.

    Returns
    -------
    Metrics: photos, registered, points, reprojection_px, track_length, focal_px,
    unregistered (name to reason).

    Raises
    ------
    InputError : no photos, or a reference that cannot be used.
    StageError : COLMAP failed, or no two photos could be put together.
    SettingsError : an option this COLMAP would end the process on.
    """
    check_supported(settings)
    photos = photo_entries(scan)
    if settings.reference:
        from walltopo.sparse.align import run_update

        return run_update(scan, photos, settings, progress)
    model_path = reconstruct(scan, photos, settings, progress)
    kept = registered_names(model_path)
    missing = {photo["name"]: photo["name"] for photo in photos if photo["name"] not in kept}
    elsewhere = other_models(model_path.parent, model_path)
    reasons = why_unregistered(_database(scan), missing, elsewhere)
    with atomic_path(scan.sparse_raw) as folder:
        shutil.copytree(model_path, folder)
    # A model of an earlier aligned run must not be taken for this one's frame.
    scan.aligned.unlink(missing_ok=True)
    for name, reason in reasons.items():
        progress.note(f"{name} not registered: {reason}")
    return {**describe_model(open_model(scan.sparse_raw), len(photos)), "unregistered": reasons}


def photo_entries(scan: ScanFolder) -> list[dict[str, Any]]:
    """The photos of `photos.json`, sorted by name.

    Raises
    ------
    InputError : fewer than two, or a photo file is missing.
    """
    photos = sorted(read_json(scan.photo_list)["photos"], key=lambda photo: photo["name"])
    if len(photos) < 2:
        raise InputError(f"{scan.photo_list}: {len(photos)} photo(s), at least 2 are needed")
    for photo in photos:
        if not (scan.photos / photo["name"]).is_file():
            raise InputError(f"{scan.photos / photo['name']}: the photo is missing")
    return photos


def reconstruct(
    scan: ScanFolder,
    photos: Sequence[dict[str, Any]],
    settings: SparseSettings,
    progress: Progress,
) -> Path:
    """Map the photos on their own; the folder of the largest model (below `work/`)."""
    cameras, indices = camera_entries(photos)
    job = mapping_job(_database(scan), scan.photos, settings)
    job["cameras"] = cameras
    job["images"] = [
        {"name": photo["name"], "camera": index}
        for photo, index in zip(photos, indices, strict=True)
    ]
    job["pairing"]["new"] = list(range(1, len(photos) + 1))
    job["map"] = {
        "output": str(scan.work / "mapping"),
        "reference": "",
        "constant_cameras": [],
        "held_images": [],
        "only": [],
        "expected": len(photos),
    }
    keep_database(job, scan)
    # Mapping gets a process of its own: COLMAP's random state would differ between a run that
    # matched photos first and one that found them matched.
    run_worker({**job, "map": None}, progress)
    result = run_worker({**job, "pairing": None}, progress)
    models = result["models"]
    if not models:
        raise StageError(
            f"none of the {len(photos)} photos could be put together",
            "They share too little: take photos that overlap by two thirds, of one wall, sharp "
            "and not all from one spot.",
        )
    if len(models) > 1:
        counts = sorted(models.values(), reverse=True)
        progress.note(
            f"the photos fall into {len(models)} groups that do not connect "
            f"({', '.join(map(str, counts))} photos); the largest is kept"
        )
    return Path(result["best"])


def camera_entries(
    photos: Sequence[dict[str, Any]],
) -> tuple[list[dict[str, Any]], list[int]]:
    """One SIMPLE_RADIAL camera per (size, focal prior), and each photo's index into them."""
    keys: dict[tuple[int, int, float | None], int] = {}
    indices = [
        keys.setdefault((photo["width"], photo["height"], photo["focal_px"]), len(keys))
        for photo in photos
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


def keep_database(job: dict[str, Any], scan: ScanFolder) -> None:
    """Drop the feature database unless it was made from these photos with these settings."""
    key = {name: job[name] for name in ("cameras", "images", "min_matches", "seed")}
    key |= _feature_key(job, scan)
    stamp = Path(job["database"]).parent / _STAMP
    if not (stamp.is_file() and read_json(stamp) == key):
        shutil.rmtree(stamp.parent, ignore_errors=True)
        write_json(stamp, key)


def known_features(job: dict[str, Any], other: ScanFolder) -> Path | None:
    """The feature database of another scan, if it holds what this job would find again."""
    stamp = _database(other).parent / _STAMP
    if not (stamp.is_file() and _database(other).is_file()):
        return None
    told, wanted = read_json(stamp), _feature_key(job, other)
    return _database(other) if {name: told.get(name) for name in wanted} == wanted else None


def _feature_key(job: dict[str, Any], scan: ScanFolder) -> dict[str, Any]:
    """What a photo's features follow from."""
    settings = {name: job[name] for name in ("max_features", "first_octave")}
    return {**settings, "photos": hash_path(scan.photos)}


def _database(scan: ScanFolder) -> Path:
    return scan.work / "features" / "features.db"

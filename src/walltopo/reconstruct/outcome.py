"""What a mapping run gave: figures of the model, and why photos are not in it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walltopo.formats.colmap import open_model

__all__ = ["describe_model", "why_unregistered"]

_FEW_FEATURES = 200


def describe_model(model: Any, photos: int) -> dict[str, Any]:
    """Figures of a `pycolmap.Reconstruction` for the stage's summary (pixels, counts)."""
    used = {image.camera_id for image in model.images.values() if image.has_pose}
    focals = [model.cameras[number].mean_focal_length() for number in sorted(used)]
    return {
        "photos": photos,
        "registered": model.num_reg_images(),
        "points": model.num_points3D(),
        "reprojection_px": round(model.compute_mean_reprojection_error(), 4),
        "track_length": round(model.compute_mean_track_length(), 3),
        "focal_px": [round(focal, 2) for focal in focals],
    }


def why_unregistered(
    database: Path, photos: Sequence[dict[str, Any]], model_path: Path, models: Path
) -> dict[str, str]:
    """A reason for each photo that is not in the kept model, from what COLMAP found in it."""
    import pycolmap

    kept = _registered(model_path)
    missing = [photo["name"] for photo in photos if photo["name"] not in kept]
    if not missing:
        return {}
    elsewhere: dict[str, int] = {}
    for folder in sorted(models.iterdir()):
        if folder != model_path and (folder / "images.bin").is_file():
            names = _registered(folder)
            elsewhere |= {name: len(names) for name in names}
    reasons: dict[str, str] = {}
    with pycolmap.Database.open(database) as db:
        ids = {image.name: image.image_id for image in db.read_all_images()}
        pair_ids, counts = db.read_two_view_geometry_num_inliers()
        linked: dict[int, int] = {}
        for pair, count in zip(pair_ids, counts, strict=True):
            for number in pycolmap.pair_id_to_image_pair(pair) if count else ():
                linked[number] = linked.get(number, 0) + 1
        for name in missing:
            features = db.num_keypoints_for_image(ids[name])
            reasons[name] = _reason(features, linked.get(ids[name], 0), elsewhere.get(name, 0))
    return reasons


def _reason(features: int, linked: int, group: int) -> str:
    if features < _FEW_FEATURES:
        return f"only {features} features found: blurred, dark or a plain surface"
    if linked == 0:
        return "nothing in it matches any other photo: another place, or too little overlap"
    if group:
        return f"it belongs to a separate group of {group} photos: take photos that link the two"
    return (
        f"it matches {linked} other photo(s), but too few of the points they share are in the "
        "model: take photos between it and its neighbours"
    )


def _registered(path: Path) -> set[str]:
    return {str(image.name) for image in open_model(path).images.values() if image.has_pose}

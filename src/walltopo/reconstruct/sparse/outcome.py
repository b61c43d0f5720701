"""Figures of a mapping run, reasons for unregistered photos, and checks of weak links."""

from __future__ import annotations

from collections import Counter
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.scans.colmap_model import open_model

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
    database: Path, missing: Mapping[str, str], elsewhere: Mapping[str, int]
) -> dict[str, str]:
    """A reason for each photo that is not in the model, from what COLMAP found in it.

    Parameters
    ----------
    database : the feature database.
    missing : photo name to its name in the database.
    elsewhere : photo name to the size of another model that it is in.

    Returns
    -------
    Photo name to the reason.
    """
    from walltopo.geometry.colmap import pycolmap

    if not missing:
        return {}
    reasons: dict[str, str] = {}
    with pycolmap.Database.open(database) as db:
        ids = {str(image.name): image.image_id for image in db.read_all_images()}
        linked: Counter[int] = Counter()
        for pair, count in zip(*db.read_two_view_geometry_num_inliers(), strict=True):
            if count:
                linked.update(pycolmap.pair_id_to_image_pair(pair))
        for photo, name in missing.items():
            features = db.num_keypoints_for_image(ids[name])
            reasons[photo] = _reason(features, linked[ids[name]], elsewhere.get(photo, 0))
    return reasons


def other_models(models: Path, kept: Path) -> dict[str, int]:
    """Photo name to the size of its model, for the models beside the kept one."""
    sizes: dict[str, int] = {}
    for folder in sorted(models.iterdir()):
        if folder != kept and (folder / "images.bin").is_file():
            names = registered_names(folder)
            sizes |= {name: len(names) for name in names}
    return sizes


def camera_centres(model: Any) -> dict[str, NDArray[np.float64]]:
    """Where each registered photo of a `pycolmap.Reconstruction` was taken, (3,), by its name."""
    return {
        str(image.name): np.asarray(image.projection_center())
        for image in model.images.values()
        if image.has_pose
    }


def registered_names(path: Path) -> set[str]:
    """Names of the registered photos of a model folder."""
    return set(camera_centres(open_model(path)))


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


Floats = NDArray[np.float64]

# Of the spread of all that the new photos see, along the second widest direction. Two rooms with
# the same printed measure on the same floor share .22; parts of one wall shared half or more.
_LEAST_SPREAD = 0.35

_LEAST_TIES = 15


def hang_together(model: Any, known: Collection[str]) -> bool:
    """Whether photos are tied to the known ones by more than one thing that both show.

    Rooms that show one printed measure, a poster or the same hold are matched by it, and fit.

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of all.
    known : names of the photos that belong together for certain.
    """
    new = {
        image.image_id
        for image in model.images.values()
        if image.has_pose and str(image.name) not in known
    }
    if not new or len(new) == model.num_reg_images():
        return True
    ties, seen = [], []
    for point in model.points3D.values():
        mine = {element.image_id in new for element in point.track.elements}
        if True in mine:
            seen.append(point.xyz)
            if False in mine:
                ties.append(point.xyz)
    if len(ties) < _LEAST_TIES:
        return False
    return _spread(np.array(ties)) >= _LEAST_SPREAD * _spread(np.array(seen))


def _spread(points: Floats) -> float:
    """Standard deviation along the second widest direction of (n, 3) points."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]
    return float(spread) / float(np.sqrt(len(points)))

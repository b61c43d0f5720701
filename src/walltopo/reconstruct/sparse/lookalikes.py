"""Reject models that join places which merely look alike.

Repeated panels, posters and holds of one kind can be matched consistently but wrongly. A model with
more photos is compared with the model before, whose photos belong together for certain.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.geometry.similarity import fit_similarity
from walltopo.scans.colmap_model import view_of_image

Floats = NDArray[np.float64]

_MIN_SHARED = 4  # minimum number of common photos to compare two models
_MAX_DISAGREEMENT = 0.05  # maximum median distance, as a share of the cameras' extent


def models_agree(known: Mapping[str, Floats], found: Mapping[str, Floats]) -> bool:
    """Return whether the common cameras of two models agree after a similarity fit."""
    shared = sorted(known.keys() & found.keys())
    if len(shared) < _MIN_SHARED:
        return True
    before, after = (np.array([one[name] for name in shared]) for one in (known, found))
    try:
        moved = fit_similarity(after, before).apply(after) - before
    except InputError:  # collinear or coincident cameras cannot be compared
        return True
    apart = np.linalg.norm(moved, axis=1)
    return bool(np.median(apart) <= _MAX_DISAGREEMENT * np.ptp(before, axis=0).max())


# Minimum ratio of the spread of the shared points to that of all points of the new photos, along
# the second widest direction. Two rooms with the same scale plate have 0.22, parts of one wall
# have 0.5 or more.
_MIN_SPREAD = 0.35

_MIN_TIES = 15


def are_connected(model: Any, known: Collection[str]) -> bool:
    """Return whether the new photos connect to the known ones by more than a single object.

    Different rooms that show the same scale plate, poster or hold match by it consistently.

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of all photos.
    known : names of the photos that belong together for certain.
    """
    new = {
        image.image_id
        for image in model.images.values()
        if image.has_pose and str(image.name) not in known
    }
    if not new or len(new) == model.num_reg_images():
        return True
    shared, seen = [], []
    for point in model.points3D.values():
        mine = {element.image_id in new for element in point.track.elements}
        if True in mine:
            seen.append(point.xyz)
            if False in mine:
                shared.append(point.xyz)
    if len(shared) < _MIN_TIES:
        return False
    return _width_deviation(np.array(shared)) >= _MIN_SPREAD * _width_deviation(np.array(seen))


def _width_deviation(points: Floats) -> float:
    """Return the standard deviation along the second widest direction of (n, 3) points."""
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)[1]
    return float(spread) / float(np.sqrt(len(points)))


# A photo that observes a smaller share of the expected points is in the wrong place. On generated
# walls, photos in their place had .22 and more, photos joined to another wall .04 and less.
_MIN_OBSERVED = 0.1
_MAX_MISPLACED = 0.25  # maximum share of such photos among the new ones
_MIN_EXPECTED = 20  # points; fewer say nothing
_MIN_VIEWERS = 2  # photos that observe a point before another photo is expected to
_MIN_COSINE = 0.85  # about 30 degrees between the directions of expected observations
_MAX_ZOOM = 1.6  # ratio of their distances


def are_observed(model: Any, known: Collection[str]) -> bool:
    """Return whether the new photos observe the points that they should show.

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of all photos.
    known : names of the photos that belong together for certain.
    """
    shares = np.array(list(observed_shares(model, known).values()))
    shares = shares[np.isfinite(shares)]
    return not len(shares) or bool((shares < _MIN_OBSERVED).mean() <= _MAX_MISPLACED)


def observed_shares(model: Any, known: Collection[str]) -> dict[str, float]:
    """Return, for each new photo, which share of the points that it should show it observes.

    A photo that is placed at a look-alike observes few of the points that lie in its picture (N.
    Jiang, P. Tan, L.-F. Cheong, "Seeing Double Without Confusion", CVPR 2012, 3: missing
    correspondences).

    Parameters
    ----------
    model : `pycolmap.Reconstruction` of all photos.
    known : names of the photos whose points count.

    Returns
    -------
    In [0, 1] by photo name; NaN if fewer than 20 points of the known photos lie in the picture.
    """
    views = {k: view_of_image(image) for k, image in model.images.items() if image.has_pose}
    centres = {k: view.centre for k, view in views.items() if view.name in known}
    places, seen_from, tracks = [], [], []
    for point in model.points3D.values():
        track = {element.image_id for element in point.track.elements}
        viewers = [centres[k] for k in track if k in centres]
        if len(viewers) >= _MIN_VIEWERS:
            places.append(point.xyz)
            seen_from.append(np.mean(viewers, axis=0))
            tracks.append(track)
    points, origins = np.array(places).reshape(-1, 3), np.array(seen_from).reshape(-1, 3)
    shares = {}
    for number, view in views.items():
        if view.name not in known:
            expected = np.flatnonzero(_is_expected(view, points, origins))
            observed = sum(number in tracks[row] for row in expected)
            is_known = len(expected) >= _MIN_EXPECTED
            shares[view.name] = observed / len(expected) if is_known else float("nan")
    return shares


def _is_expected(view: View, points: Floats, seen_from: Floats) -> NDArray[np.bool_]:
    """Return which points (n, 3) lie in a photo's picture, and are seen from about the side and
    distance of their viewers, which have their mean at `seen_from` (n, 3)."""
    pixels, size = view.project(points), np.array([view.camera.width, view.camera.height])
    mine, theirs = view.centre - points, seen_from - points
    near, far = np.linalg.norm(mine, axis=1), np.linalg.norm(theirs, axis=1)
    cosine = (mine * theirs).sum(axis=1) / np.maximum(near * far, 1e-12)
    alike = (cosine > _MIN_COSINE) & (near < _MAX_ZOOM * far) & (far < _MAX_ZOOM * near)
    return alike & ((pixels >= 0) & (pixels < size)).all(axis=1)

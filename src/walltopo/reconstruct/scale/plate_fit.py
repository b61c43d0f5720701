"""Locate a plate in the reconstruction by two estimators.

(a) `fit_from_markers`: the published method, PnP of each marker in each photo, averaged over
markers and photos. (b) `fit_from_corners`: each corner triangulated over all photos with known
poses, then one similarity to the plate's known shape. Both return the similarity from the model to
the plate's frame. `refine` minimises the robust reprojection error of all corners, which weighs
depth and direction by their true uncertainty. The estimators are compared by the distance between
the located plate's corners and the detected corners.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, View
from walltopo.geometry.similarity import (
    Similarity,
    fit_similarity,
    fit_similarity_robust,
    mean_rotation,
)
from walltopo.images.markers import Detection
from walltopo.reconstruct.scale.known_distance import TriangulatedPoint, triangulate, undistort
from walltopo.reconstruct.scale.plates import Plate

Floats = NDArray[np.float64]

_TOLERANCE = 0.03  # share of the plate's width; a corner farther off is an outlier
_REFINE_PX = 0.5  # larger errors count linearly, not squared
_MAX_GROWTH = 0.02  # of a marker's side, by ink or light
_MARKER_TOLERANCE = 3.0  # robust standard deviations


@dataclass(frozen=True, eq=False)
class Sighting:
    """A marker's detection with the view of its photo."""

    view: View
    detection: Detection


@dataclass(frozen=True, eq=False)
class PlateFit:
    """A plate located in the model.

    Parameters
    ----------
    plate : geometry of the plate.
    way : estimator, "markers" or "corners".
    plate_from_model : model units to the plate's frame in metres.
    corners_model : (n, 3) corners of the print that the fit is based on, model units.
    corners_plate : (n, 3) the same corners in the plate's frame, metres.
    residual_mm : distance between detected and located corners at the plate, perpendicular to the
        line of sight: root mean square of the better three quarters (one marker of four may be
        occluded or confused).
    error_px : median distance between located and detected corners.
    photos : names of the photos that the fit is based on.
    """

    plate: Plate
    way: str
    plate_from_model: Similarity
    corners_model: Floats
    corners_plate: Floats
    residual_mm: float
    error_px: float
    photos: tuple[str, ...]

    @property
    def scale(self) -> float:
        """Return the metres per model unit."""
        return self.plate_from_model.scale

    @property
    def outline_model(self) -> Floats:
        """Return the (4, 3) corners of the sheet in the model frame, clockwise from the top
        left."""
        return self.plate_from_model.inverse().apply(self.plate.outline)


def fit_from_corners(plate: Plate, sightings: Sequence[Sighting]) -> PlateFit | None:
    """Triangulate each corner, then fit the plate's shape by RANSAC and least squares.

    Returns
    -------
    None if fewer than four corners can be triangulated.
    """
    model: list[Floats] = []
    plate_corners: list[Floats] = []
    photos: set[str] = set()
    for marker in plate.ids:
        seen = [s for s in sightings if s.detection.marker == marker]
        for corner, place in enumerate(plate.corners(marker)):
            found = _triangulate_corner(seen, corner)
            if found is not None:
                model.append(found.point)
                plate_corners.append(place)
                used = zip(seen, found.inliers, strict=True)
                photos |= {s.detection.photo for s, good in used if good}
    if len(model) < 4:
        return None
    points, places = np.array(model), np.array(plate_corners)
    try:
        fit, inliers = fit_similarity_robust(points, places, _TOLERANCE * plate.size[0])
    except InputError:
        return None
    if inliers.sum() < 4:
        return None
    return _make_fit(plate, "corners", fit, points[inliers], places[inliers], sightings, photos)


def fit_from_markers(plate: Plate, sightings: Sequence[Sighting]) -> PlateFit | None:
    """Locate the plate by PnP of each marker in each photo, averaged.

    Each PnP gives the plate's centre relative to a camera, in metres; the camera's centre is known
    in model units. One linear least squares gives the model units per metre and the centre.
    Rotations are averaged by the chordal mean.

    Returns
    -------
    None if the photos are too few or from one place, so that the scale is undetermined.
    """
    if len({s.detection.photo for s in sightings}) < 2:
        return None
    poses = [_plate_in_camera(plate, sighting) for sighting in sightings]
    origins = np.array([s.view.centre for s in sightings])
    toward = np.array(
        [s.view.cam_from_world[:, :3].T @ pose[1] for s, pose in zip(sightings, poses, strict=True)]
    )
    turns = [
        s.view.cam_from_world[:, :3].T @ pose[0] for s, pose in zip(sightings, poses, strict=True)
    ]
    found = _scale_and_centre(origins, toward)
    if found is None:
        return None
    units, centre, good = found
    rotation = mean_rotation([turn for turn, keep in zip(turns, good, strict=True) if keep])
    model_from_plate = Similarity(units, rotation, centre)
    corners = np.concatenate([plate.corners(marker) for marker in plate.ids])
    photos = {s.detection.photo for s, keep in zip(sightings, good, strict=True) if keep}
    return _make_fit(
        plate,
        "markers",
        model_from_plate.inverse(),
        model_from_plate.apply(corners),
        corners,
        sightings,
        photos,
    )


def refine(fit: PlateFit, sightings: Sequence[Sighting]) -> PlateFit:
    """Minimise the robust (soft L1) reprojection error of all corners of a plate.

    The parameters are rotation, translation, log scale and, for a plate of several markers, the
    factor by which its markers look larger than they are: ink spreads, and light areas grow over
    dark ones in an overexposed or blurred photo. The distances between markers are exact.
    """
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    start = fit.plate_from_model.inverse()
    markers = [s.detection.marker for s in sightings]
    grows = len(set(markers)) > 1

    def moved(x: Floats) -> Similarity:
        turn = np.asarray(Rotation.from_rotvec(x[:3]).as_matrix(), dtype=np.float64)
        units = start.scale * float(np.exp(x[6]))
        return Similarity(units, turn @ start.rotation, start.translation + start.scale * x[3:6])

    def errors(x: Floats) -> Floats:
        back = moved(x)
        corners = [fit.plate.corners(marker, x[7] if grows else 0.0) for marker in markers]
        seen = [s.view.project(back.apply(c)) for s, c in zip(sightings, corners, strict=True)]
        apart = [xy - s.detection.corners for xy, s in zip(seen, sightings, strict=True)]
        return np.nan_to_num(np.concatenate(apart).ravel(), nan=1e3)

    limits = np.array([*[np.inf] * 7, *[_MAX_GROWTH] * grows])
    best = least_squares(
        errors,
        np.zeros(len(limits)),
        loss="soft_l1",
        f_scale=_REFINE_PX,
        x_scale="jac",
        bounds=(-limits, limits),
    )
    back, growth = moved(best.x), float(best.x[7]) if grows else 0.0
    places = np.concatenate([fit.plate.corners(marker) for marker in fit.plate.ids])
    photos = set(fit.photos)
    return _make_fit(
        fit.plate, fit.way, back.inverse(), back.apply(places), places, sightings, photos, growth
    )


def _make_fit(
    plate: Plate,
    way: str,
    fit: Similarity,
    points: Floats,
    places: Floats,
    sightings: Sequence[Sighting],
    photos: set[str],
    growth: float = 0.0,
) -> PlateFit:
    """Return the fit with its residuals over all sightings, of markers that look larger."""
    back = fit.inverse()
    pixels, metres = [], []
    for s in sightings:
        corners = back.apply(plate.corners(s.detection.marker, growth))
        apart = np.linalg.norm(s.view.project(corners) - s.detection.corners, axis=1)
        pixels.append(np.nan_to_num(apart, nan=np.inf))
        metres.append(pixels[-1] * s.view.to_camera(corners)[:, 2] / s.view.camera.fx * fit.scale)
    return PlateFit(
        plate,
        way,
        fit,
        points,
        places,
        1000 * _trimmed_rms(np.concatenate(metres)),
        float(np.median(np.concatenate(pixels))),
        tuple(sorted(photos)),
    )


def _trimmed_rms(lengths: Floats) -> float:
    """Return the root mean square of the smaller three quarters."""
    kept = np.sort(np.abs(lengths))[: -(-3 * len(lengths) // 4)]
    return float(np.sqrt(np.mean(kept**2)))


def _triangulate_corner(sightings: Sequence[Sighting], corner: int) -> TriangulatedPoint | None:
    pixels = np.array([s.detection.corners[corner] for s in sightings]).reshape(-1, 2)
    return triangulate([s.view for s in sightings], pixels)


def _plate_in_camera(plate: Plate, sighting: Sighting) -> tuple[Floats, Floats]:
    """Return the plate's rotation (3, 3) and centre (3,) in the camera frame, metres, from one
    marker."""
    import cv2

    half = plate.marker / 2
    square = half * np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], dtype=float)
    uv = undistort(sighting.view.camera, sighting.detection.corners)
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        square, uv[:, None], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    # Solutions are sorted by reprojection error; the second is the ambiguous pose of a flat square.
    rotation = np.asarray(cv2.Rodrigues(turns[0])[0], dtype=np.float64)
    marker = plate.corners(sighting.detection.marker).mean(axis=0)
    centre = np.asarray(shifts[0], dtype=np.float64).ravel() - rotation @ marker
    return rotation, centre


def _scale_and_centre(
    origins: Floats, toward: Floats
) -> tuple[float, Floats, NDArray[np.bool_]] | None:
    """Solve origin_i + units * toward_i = centre by least squares, without outliers.

    Returns
    -------
    Model units per metre (> 0), the centre (3,), and (n,) bool of the inliers.
    """
    good = np.ones(len(origins), dtype=np.bool_)
    for _ in range(10):
        a, b = origins[good], toward[good]
        a0, b0 = a - a.mean(axis=0), b - b.mean(axis=0)
        spread = float((b0**2).sum())
        if good.sum() < 2 or spread < 1e-12:
            return None
        units = -float((a0 * b0).sum()) / spread
        if units <= 0:
            return None
        centre = a.mean(axis=0) + units * b.mean(axis=0)
        away = np.linalg.norm(origins + units * toward - centre, axis=1)
        inliers = away <= max(_MARKER_TOLERANCE * 1.4826 * float(np.median(away)), 1e-9 * units)
        if inliers.sum() < 2 or (inliers == good).all():
            break
        good = inliers
    return units, centre, good


def shared_scale(fits: Sequence[PlateFit]) -> float:
    """Return the metres per model unit that fit the corners of all plates best, by least
    squares."""
    top = bottom = 0.0
    for fit in fits:
        a = fit.corners_model - fit.corners_model.mean(axis=0)
        b = fit.corners_plate - fit.corners_plate.mean(axis=0)
        rotation = fit_similarity(a, b).rotation
        top += float((b * (a @ rotation.T)).sum())
        bottom += float((a**2).sum())
    return top / bottom

"""Where a plate lies in the reconstruction, found in two ways.

(a) `fit_from_markers`: the published way, the rigid transform of each marker in each photo by PnP,
averaged over markers and photos. (b) `fit_from_corners`: each corner triangulated over all photos
with their known poses, then one similarity to the plate's known shape. Both give the similarity
from the model to the plate's frame; `polish` brings either to the least robust reprojection error
of all corners, which weighs depth and direction as the photos really tell them. Ways are judged
by one yardstick: how far the plate, so placed, falls from its corners in the photos.
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
from walltopo.reconstruct.scale.markers import Detection
from walltopo.reconstruct.scale.plates import Plate
from walltopo.reconstruct.scale.rays import Triangulated, triangulate, undistort

Floats = NDArray[np.float64]

_TOLERANCE = 0.03  # of the plate's width: a corner further off its place is an outlier
_POLISH_PX = 0.5  # px; errors beyond it count linearly, not squared
_MARKER_TOLERANCE = 3.0  # robust standard deviations


@dataclass(frozen=True, eq=False)
class Sighting:
    """A marker's detection with the view it was made in."""

    view: View
    detection: Detection


@dataclass(frozen=True, eq=False)
class PlateFit:
    """One plate placed in the model.

    Parameters
    ----------
    plate : its geometry.
    way : "markers" or "corners".
    plate_from_model : model units to the plate's frame in metres.
    corners_model : (n, 3) corners of the print in model units that the fit rests on.
    corners_plate : (n, 3) the same corners in the plate's frame, metres.
    residual_mm : how far, at the plate and across the line of sight, the detected corners lie
        from their places: root mean square of the better three quarters (one marker of four may
        be covered or confused).
    error_px : median distance of the placed corners from the detected ones.
    photos : names of the photos it rests on.
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
        """Metres per model unit."""
        return self.plate_from_model.scale

    @property
    def outline_model(self) -> Floats:
        """(4, 3) corners of the sheet in the model frame, clockwise from the top left."""
        return self.plate_from_model.inverse().apply(self.plate.outline)


def fit_from_corners(plate: Plate, sightings: Sequence[Sighting]) -> PlateFit | None:
    """Triangulate each corner, then RANSAC and least squares to the plate's shape.

    Returns
    -------
    None where fewer than one marker's corners can be triangulated from two directions.
    """
    model: list[Floats] = []
    known: list[Floats] = []
    photos: set[str] = set()
    for marker in plate.ids:
        seen = [s for s in sightings if s.detection.marker == marker]
        for corner, place in enumerate(plate.corners(marker)):
            found = _triangulate_corner(seen, corner)
            if found is not None:
                model.append(found.point)
                known.append(place)
                used = zip(seen, found.inliers, strict=True)
                photos |= {s.detection.photo for s, good in used if good}
    if len(model) < 4:
        return None
    points, places = np.array(model), np.array(known)
    try:
        fit, inliers = fit_similarity_robust(points, places, _TOLERANCE * plate.size[0])
    except InputError:
        return None
    if inliers.sum() < 4:
        return None
    return _placed(plate, "corners", fit, points[inliers], places[inliers], sightings, photos)


def fit_from_markers(plate: Plate, sightings: Sequence[Sighting]) -> PlateFit | None:
    """PnP of each marker in each photo, averaged.

    Each PnP gives the plate's centre as seen from a camera, in metres; the camera's centre is
    known in model units. One linear least squares over all of them gives the model units per
    metre and the centre; rotations are averaged by the chordal mean.

    Returns
    -------
    None where the photos are too few or all from one place, so that nothing tells the scale.
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
    return _placed(
        plate,
        "markers",
        model_from_plate.inverse(),
        model_from_plate.apply(corners),
        corners,
        sightings,
        photos,
    )


def polish(fit: PlateFit, sightings: Sequence[Sighting]) -> PlateFit:
    """The same plate at the least robust (soft L1) reprojection error of all its corners.

    Seven numbers (turn, place, log of the scale) over every corner of every sighting; the
    plate's flatness and shape hold exactly.
    """
    from scipy.optimize import least_squares
    from scipy.spatial.transform import Rotation

    start = fit.plate_from_model.inverse()
    corners = [fit.plate.corners(s.detection.marker) for s in sightings]

    def moved(x: Floats) -> Similarity:
        turn = np.asarray(Rotation.from_rotvec(x[:3]).as_matrix(), dtype=np.float64)
        units = start.scale * float(np.exp(x[6]))
        return Similarity(units, turn @ start.rotation, start.translation + start.scale * x[3:6])

    def errors(x: Floats) -> Floats:
        back = moved(x)
        seen = [s.view.project(back.apply(c)) for s, c in zip(sightings, corners, strict=True)]
        apart = [xy - s.detection.corners for xy, s in zip(seen, sightings, strict=True)]
        return np.nan_to_num(np.concatenate(apart).ravel(), nan=1e3)

    best = least_squares(errors, np.zeros(7), loss="soft_l1", f_scale=_POLISH_PX, x_scale="jac")
    back = moved(best.x)
    places = np.concatenate([fit.plate.corners(marker) for marker in fit.plate.ids])
    photos = set(fit.photos)
    return _placed(
        fit.plate, fit.way, back.inverse(), back.apply(places), places, sightings, photos
    )


def _placed(
    plate: Plate,
    way: str,
    fit: Similarity,
    points: Floats,
    places: Floats,
    sightings: Sequence[Sighting],
    photos: set[str],
) -> PlateFit:
    back = fit.inverse()
    pixels, metres = [], []
    for s in sightings:
        corners = back.apply(plate.corners(s.detection.marker))
        apart = np.linalg.norm(s.view.project(corners) - s.detection.corners, axis=1)
        pixels.append(np.nan_to_num(apart, nan=np.inf))
        metres.append(pixels[-1] * s.view.to_camera(corners)[:, 2] / s.view.camera.fx * fit.scale)
    return PlateFit(
        plate,
        way,
        fit,
        points,
        places,
        1000 * _trimmed(np.concatenate(metres)),
        float(np.median(np.concatenate(pixels))),
        tuple(sorted(photos)),
    )


def _trimmed(lengths: Floats) -> float:
    """Root mean square of the smaller three quarters."""
    kept = np.sort(np.abs(lengths))[: -(-3 * len(lengths) // 4)]
    return float(np.sqrt(np.mean(kept**2)))


def _triangulate_corner(sightings: Sequence[Sighting], corner: int) -> Triangulated | None:
    pixels = np.array([s.detection.corners[corner] for s in sightings]).reshape(-1, 2)
    return triangulate([s.view for s in sightings], pixels)


def _plate_in_camera(plate: Plate, sighting: Sighting) -> tuple[Floats, Floats]:
    """Rotation (3, 3) and centre (3,) of the plate in the camera frame, metres, from one marker."""
    import cv2

    half = plate.marker / 2
    square = half * np.array([(-1, 1, 0), (1, 1, 0), (1, -1, 0), (-1, -1, 0)], dtype=float)
    uv = undistort(sighting.view.camera, sighting.detection.corners)
    _, turns, shifts, _ = cv2.solvePnPGeneric(
        square, uv[:, None], np.eye(3), None, flags=cv2.SOLVEPNP_IPPE_SQUARE
    )
    # Sorted by reprojection error; the second is the mirrored pose of a flat square.
    rotation = np.asarray(cv2.Rodrigues(turns[0])[0], dtype=np.float64)
    marker = plate.corners(sighting.detection.marker).mean(axis=0)
    centre = np.asarray(shifts[0], dtype=np.float64).ravel() - rotation @ marker
    return rotation, centre


def _scale_and_centre(
    origins: Floats, toward: Floats
) -> tuple[float, Floats, NDArray[np.bool_]] | None:
    """Least squares of origin_i + units * toward_i = centre, without the far ones.

    Returns
    -------
    Model units per metre (> 0), the centre (3,), and (n,) bool of those it rests on.
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
        again = away <= max(_MARKER_TOLERANCE * 1.4826 * float(np.median(away)), 1e-9 * units)
        if again.sum() < 2 or (again == good).all():
            break
        good = again
    return units, centre, good


def shared_scale(fits: Sequence[PlateFit]) -> float:
    """Metres per model unit: the least squares scale common to all plates' corners."""
    top = bottom = 0.0
    for fit in fits:
        a = fit.corners_model - fit.corners_model.mean(axis=0)
        b = fit.corners_plate - fit.corners_plate.mean(axis=0)
        rotation = fit_similarity(a, b).rotation
        top += float((b * (a @ rotation.T)).sum())
        bottom += float((a**2).sum())
    return top / bottom

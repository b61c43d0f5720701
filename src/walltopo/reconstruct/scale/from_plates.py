"""Compute scale, floor and world frame from the scale plates in the photos."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError, View
from walltopo.geometry.similarity import Similarity, fit_plane, rotation_with_z
from walltopo.images.markers import Detection
from walltopo.reconstruct.scale.known_distance import triangulate
from walltopo.reconstruct.scale.plate_fit import (
    PlateFit,
    Sighting,
    fit_from_corners,
    fit_from_markers,
    refine,
    shared_scale,
)
from walltopo.reconstruct.scale.plates import Plate

Floats = NDArray[np.float64]

MAX_DISAGREEMENT = 0.01  # maximum relative difference of a plate's scale
_MAX_RESIDUAL_MM = 5.0  # maximum root mean square of a plate's corner residuals
_FLOOR_TILT_DEG = 40.0  # maximum angle between up and the normal of a plate on the floor
_MAX_OFF_FLOOR = 0.03  # m; a plate farther from the common floor plane is reported

_ESTIMATORS = {
    "auto": (fit_from_corners, fit_from_markers),
    "corners": (fit_from_corners,),
    "markers": (fit_from_markers,),
    "published": (fit_from_markers,),
}


@dataclass(frozen=True)
class PlateReport:
    """The result for one plate; written to `scale.json`.

    `outline` holds the sheet's top left, top right, bottom right and bottom left corner in the
    model frame; () if the plate could not be located.
    """

    ids: tuple[int, ...]
    label: str
    used: bool
    way: str = ""
    scale: float = 0.0  # metres per model unit
    residual_mm: float = 0.0
    error_px: float = 0.0
    photos: tuple[str, ...] = ()
    problem: str = ""
    outline: tuple[tuple[float, float, float], ...] = ()


@dataclass(frozen=True, eq=False)
class PlateFrame:
    """The world frame (scale, up and floor) that the plates define.

    Parameters
    ----------
    world_from_model : model units to the world: metres, z up, floor at z = 0, origin below the
        centre of the plate with the lowest ids, x along its top edge.
    floor_known : whether a plate lies on the floor (otherwise up is the caller's estimate).
    plates : report of each detected plate.
    notes : warnings for the user.
    of_stickers : whether the plates are stickers on the wall.
    """

    world_from_model: Similarity
    floor_known: bool
    plates: tuple[PlateReport, ...]
    notes: tuple[str, ...] = ()
    of_stickers: bool = False


@dataclass
class _Outcome:
    """The fits and faults of all plates so far."""

    fits: list[PlateFit] = field(default_factory=list[PlateFit])
    faults: dict[str, str] = field(default_factory=dict[str, str])
    duplicated: list[str] = field(default_factory=list[str])


def frame_from_plates(
    views: Sequence[View],
    detections: Iterable[Detection],
    plates: Sequence[Plate],
    up: Floats,
    *,
    way: str = "auto",
    tolerance: float = MAX_DISAGREEMENT,
) -> tuple[PlateFrame | None, tuple[PlateReport, ...], tuple[str, ...]]:
    """Compute scale, up and the world frame from markers detected in posed photos.

    Parameters
    ----------
    views : registered photos, model frame.
    detections : detected markers; those in photos without a view are ignored.
    plates : known plate geometries.
    up : (3,) unit, rough up direction in the model frame (from the cameras).
    way : estimator: "markers", "corners" or "auto" (the better one per plate), each refined; or
        "published": "markers", not refined.
    tolerance : maximum relative difference of a plate's scale from another's.

    Returns
    -------
    The plate frame, or None if no plate is usable; the reports; and notes for the user.

    Raises
    ------
    StageError : plates contradict each other and no majority decides, or two plates carry the same
        ids and no other plate is usable.
    """
    by_name = {view.name: view for view in views}
    detections = list(detections)
    outcome = _Outcome()
    for plate in plates:
        own = [d for d in detections if d.marker in plate.ids and d.dictionary == plate.dictionary]
        if _is_present(own):
            _fit_plate(plate, own, by_name, way, outcome)
    _reject_outliers(outcome, tolerance)
    good = [fit for fit in outcome.fits if fit.plate.label not in outcome.faults]
    reports = _plate_reports(outcome, good)
    notes = tuple(f"plate {label}: {fault}" for label, fault in outcome.faults.items())
    if not good:
        if outcome.duplicated:
            raise StageError(
                f"plate {outcome.duplicated[0]}: {outcome.faults[outcome.duplicated[0]]}",
                "Print plates with different ids (`walltopo measure print --number 2`), or set "
                "scale.method=none to go on without metres.",
            )
        return None, reports, notes
    floor = [fit for fit in good if fit.plate.floor and _lies_flat(fit, up)]
    world, uneven = _world_frame(good, floor, up)
    if not floor:
        notes = (*notes, "no plate lies on the floor: up is estimated from the cameras")
    return PlateFrame(world, bool(floor), reports, (*notes, *uneven)), reports, (*notes, *uneven)


def _is_present(detections: Sequence[Detection]) -> bool:
    """Return whether a plate is in the photos; a single marker in one photo may be a false
    positive."""
    markers_in: dict[str, set[int]] = {}
    for detection in detections:
        markers_in.setdefault(detection.photo, set()).add(detection.marker)
    return len(markers_in) >= 2 or any(len(found) >= 2 for found in markers_in.values())


def _fit_plate(
    plate: Plate,
    detections: Sequence[Detection],
    views: dict[str, View],
    way: str,
    outcome: _Outcome,
) -> None:
    """Fit one plate and record the fit or the fault in `outcome`."""
    label = plate.label
    used = [Sighting(views[d.photo], d) for d in detections if d.photo in views]
    photos = sorted({s.detection.photo for s in used})
    if len(photos) < 2:
        seen = sorted({d.photo for d in detections})
        where = (
            f"in one registered photo only ({photos[0]})"
            if photos
            else (f"only in photos that are not registered ({', '.join(seen[:3])})")
        )
        outcome.faults[label] = f"seen {where}; take 3 or more photos of it from around"
        return
    if listing := _duplicate_marker(used):
        outcome.faults[label] = listing
        outcome.duplicated.append(label)
        return
    fits = [fit for attempt in _ESTIMATORS[way] if (fit := attempt(plate, used)) is not None]
    if way != "published":
        fits = [refine(fit, used) for fit in fits]
    if not fits:
        outcome.faults[label] = (
            f"seen in {len(photos)} photos, but from too nearly one place to measure it"
        )
        return
    # Refined estimators usually reach the same optimum; rounding then selects the first one.
    best = min(fits, key=lambda fit: round(fit.error_px, 2))
    outcome.fits.append(best)
    if best.residual_mm > _MAX_RESIDUAL_MM:
        outcome.faults[label] = (
            f"its corners miss their places by {best.residual_mm:.1f} mm (root mean square; at "
            f"most {_MAX_RESIDUAL_MM:g}): bent, moved between photos, or not of this shape"
        )


def _duplicate_marker(sightings: Sequence[Sighting]) -> str:
    """Return a message if one marker is at two places, else ""."""
    by_marker: dict[int, list[Sighting]] = {}
    for sighting in sightings:
        by_marker.setdefault(sighting.detection.marker, []).append(sighting)
    for marker, seen in by_marker.items():
        photos = [s.detection.photo for s in seen]
        duplicate = next((p for p in photos if photos.count(p) > 1), None)
        if duplicate is not None:
            return f"marker {marker} is twice in {duplicate}: two plates carry the same ids"
        if _is_at_two_places(seen):
            return f"marker {marker} is at two places: two plates carry the same ids, or it moved"
    return ""


def _is_at_two_places(seen: Sequence[Sighting]) -> bool:
    """Return whether the observations of a marker triangulate to two different points."""
    pixels = np.array([s.detection.corners.mean(axis=0) for s in seen])
    found = triangulate([s.view for s in seen], pixels, tolerance_px=8.0)
    if found is None or found.inliers.all():
        return False
    rest = ~found.inliers
    others = [s.view for s, odd in zip(seen, rest, strict=True) if odd]
    again = triangulate(others, pixels[rest], tolerance_px=8.0)
    return again is not None


def _reject_outliers(outcome: _Outcome, tolerance: float) -> None:
    """Reject plates whose scale differs from the majority; raise StageError without a majority."""
    fits = [fit for fit in outcome.fits if fit.plate.label not in outcome.faults]
    if len(fits) < 2:
        return
    scales = np.array([fit.scale for fit in fits])
    agree = np.abs(scales[:, None] / scales[None, :] - 1) <= tolerance
    largest = int(agree.sum(axis=1).argmax())
    if 2 * agree[largest].sum() <= len(fits):
        listing = "; ".join(f"{fit.plate.label}: {fit.scale / scales.min():.4f}" for fit in fits)
        raise StageError(
            f"the plates disagree about the scale and nothing tells which is right ({listing}, "
            "relative to the smallest)",
            "Check each print with a ruler: one may be printed at the wrong size. Leave it out "
            "with --set scale.ignore_plates=ID (its lowest marker id).",
        )
    common = float(np.median(scales[agree[largest]]))
    for fit, agrees in zip(fits, agree[largest], strict=True):
        if not agrees:
            # The size is inverse to the scale: an oversized print makes the model look small.
            size = common / fit.scale
            outcome.faults[fit.plate.label] = (
                f"disagrees with the others: it is {size:.3f} times the size it should be "
                "(printed at the wrong size?); left out"
            )


def _lies_flat(fit: PlateFit, up: Floats) -> bool:
    """Return whether the plate's normal points up within the tolerance."""
    normal = fit.plate_from_model.rotation[2]
    return bool(normal @ up > np.cos(np.radians(_FLOOR_TILT_DEG)))


def _world_frame(
    fits: Sequence[PlateFit], floor: Sequence[PlateFit], up: Floats
) -> tuple[Similarity, list[str]]:
    """Return world_from_model, and notes on plates that lie off the common floor."""
    scale = shared_scale(fits)
    first = min(floor or fits, key=lambda fit: min(fit.plate.ids))
    back = first.plate_from_model.inverse()
    centre = back.translation
    # Without a plate on the floor, this is the top edge of a plate on a wall.
    ahead = back.rotation[:, 0]
    notes: list[str] = []
    height = 0.0
    if floor:
        # Floor points in the model frame: the corners lowered by the plate's thickness.
        below = [
            fit.corners_model - fit.plate.thickness / scale * fit.plate_from_model.rotation[2]
            for fit in floor
        ]
        normal, offset = fit_plane(np.concatenate(below))
        if normal @ np.sum([fit.plate_from_model.rotation[2] for fit in floor], axis=0) < 0:
            normal, offset = -normal, -offset
        up = normal
        height = float(centre @ up) - offset
        for fit, points in zip(floor, below, strict=True):
            away = scale * float(np.abs(points @ normal - offset).max())
            if away > _MAX_OFF_FLOOR:
                notes.append(
                    f"plate {fit.plate.label} is {1000 * away:.0f} mm off the common floor: the "
                    "floor is uneven, or the plate does not lie on it"
                )
    rotation = rotation_with_z(up, ahead)
    origin = centre - height * up
    return Similarity(scale, rotation, -scale * rotation @ origin), notes


def _plate_reports(outcome: _Outcome, good: Sequence[PlateFit]) -> tuple[PlateReport, ...]:
    """Return a report of each plate, fitted or not."""
    used = {fit.plate.label for fit in good}
    fitted = {fit.plate.label: fit for fit in outcome.fits}
    reports = [
        PlateReport(
            fit.plate.ids,
            label,
            label in used,
            fit.way,
            fit.scale,
            fit.residual_mm,
            fit.error_px,
            fit.photos,
            outcome.faults.get(label, ""),
            tuple((x, y, z) for x, y, z in fit.outline_model.tolist()),
        )
        for label, fit in fitted.items()
    ]
    reports += [
        PlateReport((), label, False, problem=fault)
        for label, fault in outcome.faults.items()
        if label not in fitted
    ]
    return tuple(reports)

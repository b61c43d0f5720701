"""The measure: plates seen in the photos give scale, floor and the world frame."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from walltopo.core import StageError, View
from walltopo.geometry.similarity import Similarity, fit_plane, rotation_with_z
from walltopo.reconstruct.scale.markers import Detection
from walltopo.reconstruct.scale.plate_fit import (
    PlateFit,
    Sighting,
    fit_from_corners,
    fit_from_markers,
    polish,
    shared_scale,
)
from walltopo.reconstruct.scale.plates import Plate
from walltopo.reconstruct.scale.rays import triangulate

Floats = NDArray[np.float64]

MOST_DISAGREEMENT = 0.01  # relative difference of scale at which a plate is left out
_MOST_RESIDUAL_MM = 5.0  # root mean square of a plate's corner residuals at which it is left out
_FLOOR_TILT_DEG = 40.0  # of a plate against the cameras' up, beyond which it does not lie flat
_UNEVEN = 0.03  # m; a plate further from the common floor plane than this is reported

_WAYS = {
    "auto": (fit_from_corners, fit_from_markers),
    "corners": (fit_from_corners,),
    "markers": (fit_from_markers,),
    "published": (fit_from_markers,),
}


@dataclass(frozen=True)
class PlateReport:
    """What became of one plate; goes into `scale.json`.

    `outline` is its sheet's top left, top right, bottom right and bottom left corner in the model
    frame, () where it could not be placed.
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
class Measure:
    """Scale, up and floor from the plates.

    Parameters
    ----------
    world_from_model : model units to the world: metres, z up, floor at z = 0, origin below the
        centre of the plate with the lowest ids, x along its top edge.
    floor_known : whether a plate lay on the floor (else up is the caller's).
    plates : a report of each plate that was seen.
    notes : lines for people.
    """

    world_from_model: Similarity
    floor_known: bool
    plates: tuple[PlateReport, ...]
    notes: tuple[str, ...] = ()


@dataclass
class _Outcome:
    """Fits and what is wrong, collected plate by plate."""

    fits: list[PlateFit] = field(default_factory=list[PlateFit])
    problems: dict[str, str] = field(default_factory=dict[str, str])
    doubled: list[str] = field(default_factory=list[str])


def measure_from_plates(
    views: Sequence[View],
    detections: Iterable[Detection],
    plates: Sequence[Plate],
    up: Floats,
    *,
    way: str = "auto",
) -> tuple[Measure | None, tuple[PlateReport, ...], tuple[str, ...]]:
    """Scale, up and the world frame from the markers seen in posed photos.

    Parameters
    ----------
    views : registered photos, model frame.
    detections : markers; those in photos that are not among the views are not used.
    plates : the known geometries.
    up : (3,) unit, a rough up in the model frame (from the cameras).
    way : "markers", "corners" or "auto" (per plate whichever fits the photos better), each
        polished; or "published": "markers" as it is.

    Returns
    -------
    The measure, or None where no plate is usable; the reports; and notes for people.

    Raises
    ------
    StageError : plates contradict each other and nothing tells which is right, or two plates
        carry the same ids and no other plate is there.
    """
    by_name = {view.name: view for view in views}
    detections = list(detections)
    outcome = _Outcome()
    for plate in plates:
        own = [d for d in detections if d.marker in plate.ids and d.dictionary == plate.dictionary]
        if _seen(own):
            _fit_plate(plate, own, by_name, way, outcome)
    _leave_out_disagreeing(outcome)
    good = [fit for fit in outcome.fits if fit.plate.label not in outcome.problems]
    reports = _reports(outcome, good)
    notes = tuple(f"plate {label}: {problem}" for label, problem in outcome.problems.items())
    if not good:
        if outcome.doubled:
            raise StageError(
                f"plate {outcome.doubled[0]}: {outcome.problems[outcome.doubled[0]]}",
                "Print plates with different ids (`walltopo measure print --number 2`), or set "
                "scale.method=none to go on without metres.",
            )
        return None, reports, notes
    floor = [fit for fit in good if fit.plate.floor and _lies_flat(fit, up)]
    world, uneven = _world_frame(good, floor, up)
    if not floor:
        notes = (*notes, "no plate lies on the floor: up is estimated from the cameras")
    return Measure(world, bool(floor), reports, (*notes, *uneven)), reports, (*notes, *uneven)


def _seen(detections: Sequence[Detection]) -> bool:
    """Whether a plate is there at all: one lone marker in one photo may be a false alarm."""
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
        outcome.problems[label] = f"seen {where}; take 3 or more photos of it from around"
        return
    if told := _doubled(used):
        outcome.problems[label] = told
        outcome.doubled.append(label)
        return
    fits = [fit for attempt in _WAYS[way] if (fit := attempt(plate, used)) is not None]
    if way != "published":
        fits = [polish(fit, used) for fit in fits]
    if not fits:
        outcome.problems[label] = (
            f"seen in {len(photos)} photos, but from too nearly one place to measure it"
        )
        return
    # Polished, sound ways meet in one optimum; then the first one stands.
    best = min(fits, key=lambda fit: round(fit.error_px, 2))
    outcome.fits.append(best)
    if best.residual_mm > _MOST_RESIDUAL_MM:
        outcome.problems[label] = (
            f"its corners miss their places by {best.residual_mm:.1f} mm (root mean square; at "
            f"most {_MOST_RESIDUAL_MM:g}): bent, moved between photos, or not of this shape"
        )


def _doubled(sightings: Sequence[Sighting]) -> str:
    """Says so where the same marker is at two places; '' where it is not."""
    by_marker: dict[int, list[Sighting]] = {}
    for sighting in sightings:
        by_marker.setdefault(sighting.detection.marker, []).append(sighting)
    for marker, seen in by_marker.items():
        photos = [s.detection.photo for s in seen]
        twice = next((p for p in photos if photos.count(p) > 1), None)
        if twice is not None:
            return f"marker {marker} is twice in {twice}: two plates carry the same ids"
        if _two_places(seen):
            return f"marker {marker} is at two places: two plates carry the same ids, or it moved"
    return ""


def _two_places(seen: Sequence[Sighting]) -> bool:
    pixels = np.array([s.detection.corners.mean(axis=0) for s in seen])
    found = triangulate([s.view for s in seen], pixels, tolerance_px=8.0)
    if found is None or found.inliers.all():
        return False
    rest = ~found.inliers
    others = [s.view for s, odd in zip(seen, rest, strict=True) if odd]
    again = triangulate(others, pixels[rest], tolerance_px=8.0)
    return again is not None


def _leave_out_disagreeing(outcome: _Outcome) -> None:
    """Name the plates whose scale is off the median of all; two that differ cannot be judged."""
    fits = [fit for fit in outcome.fits if fit.plate.label not in outcome.problems]
    if len(fits) < 2:
        return
    scales = np.array([fit.scale for fit in fits])
    agree = np.abs(scales[:, None] / scales[None, :] - 1) <= MOST_DISAGREEMENT
    most = int(agree.sum(axis=1).argmax())
    if 2 * agree[most].sum() <= len(fits):
        told = "; ".join(f"{fit.plate.label}: {fit.scale / scales.min():.4f}" for fit in fits)
        raise StageError(
            f"the plates disagree about the scale and nothing tells which is right ({told}, "
            "relative to the smallest)",
            "Check each print with a ruler: one may be printed at the wrong size. Leave it out "
            "with --set scale.ignore_plates=ID (its lowest marker id).",
        )
    common = float(np.median(scales[agree[most]]))
    for fit, fine in zip(fits, agree[most], strict=True):
        if not fine:
            # Sizes and scales go opposite ways: too large a print makes the model look small.
            size = common / fit.scale
            outcome.problems[fit.plate.label] = (
                f"disagrees with the others: it is {size:.3f} times the size it should be "
                "(printed at the wrong size?); left out"
            )


def _lies_flat(fit: PlateFit, up: Floats) -> bool:
    normal = fit.plate_from_model.rotation[2]
    return bool(normal @ up > np.cos(np.radians(_FLOOR_TILT_DEG)))


def _world_frame(
    fits: Sequence[PlateFit], floor: Sequence[PlateFit], up: Floats
) -> tuple[Similarity, list[str]]:
    """World from model, and notes on plates that lie off the common floor."""
    scale = shared_scale(fits)
    first = min(floor or fits, key=lambda fit: min(fit.plate.ids))
    back = first.plate_from_model.inverse()
    centre = back.translation
    # Without a plate on the floor, x runs along the top edge of one that hangs on a wall.
    ahead = back.rotation[:, 0]
    notes: list[str] = []
    height = 0.0
    if floor:
        # In the model frame, lowered by each plate's own thickness.
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
            if away > _UNEVEN:
                notes.append(
                    f"plate {fit.plate.label} is {1000 * away:.0f} mm off the common floor: the "
                    "floor is uneven, or the plate does not lie on it"
                )
    rotation = rotation_with_z(up, ahead)
    origin = centre - height * up
    return Similarity(scale, rotation, -scale * rotation @ origin), notes


def _reports(outcome: _Outcome, good: Sequence[PlateFit]) -> tuple[PlateReport, ...]:
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
            outcome.problems.get(label, ""),
            tuple((x, y, z) for x, y, z in fit.outline_model.tolist()),
        )
        for label, fit in fitted.items()
    ]
    reports += [
        PlateReport((), label, False, problem=problem)
        for label, problem in outcome.problems.items()
        if label not in fitted
    ]
    return tuple(reports)

"""The scale stage: metres, up and the floor; `work/sparse` to `sparse/` and `scale.json`."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, StageError, View
from walltopo.geometry.similarity import Similarity
from walltopo.reconstruct.scale.from_plates import (
    MOST_DISAGREEMENT,
    Measure,
    PlateReport,
    measure_from_plates,
)
from walltopo.reconstruct.scale.known_distance import named_points, scale_from_distance
from walltopo.reconstruct.scale.markers import Detection, detect_markers
from walltopo.reconstruct.scale.plates import Plate, built_in_plates, read_plates
from walltopo.reconstruct.scale.settings import ScaleSettings
from walltopo.reconstruct.scale.upright import (
    turned_photos,
    typical_unit,
    up_from_cameras,
    upright_frame,
)
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.context import Context
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.scale import Aligned, Scale
from walltopo.scans.scale import Plate as PlateRecord

Floats = NDArray[np.float64]


def find_world(
    photos: PhotoSet,
    raw: SparseModel,
    aligned: Aligned | None,
    settings: ScaleSettings,
    context: Context,
) -> tuple[SparseModel, Scale, Metrics]:
    """Find the scale and put the model into the world frame.

    Metrics: metric, method, scale, plates, residual_mm (the worst plate that was used).

    Raises
    ------
    InputError : a plates or points file, or a distance, that cannot be used.
    StageError : plates contradict each other, or `settings.method` insists on what is not there.
    """
    model = raw.open()
    points = np.array([point.xyz for point in model.points3D.values()]).reshape(-1, 3)
    world, scale = _decide(photos, raw.views, aligned, points, settings, context.progress)
    if not scale.up_known:
        scale = replace(scale, notes=scale.notes + _notes_on_turned(raw.views))
    for line in scale.notes:
        context.progress.note(line)
    residuals = [plate.residual_mm for plate in scale.plates if plate.used]
    return (
        _in_world(model, world, context.scratch / "sparse"),
        scale,
        {
            "metric": scale.metric,
            "method": scale.method,
            "scale": scale.scale,
            "plates": len(residuals),
            "residual_mm": max(residuals, default=None),
        },
    )


def _decide(
    photos: PhotoSet,
    views: Sequence[View],
    aligned: Aligned | None,
    points: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, Scale]:
    """World from model, and what is known of it."""
    if aligned is not None:
        return _by_reference(photos, views, aligned, settings, progress)
    up = up_from_cameras(views)
    notes: list[str] = []
    plates: tuple[PlateReport, ...] = ()
    if settings.method == "distance" and not settings.distance:
        raise InputError("scale.method=distance needs scale.distance (A-B=METRES)")
    if settings.method == "distance" or (settings.method == "auto" and settings.distance):
        return _by_distance(views, points, up, settings)
    if settings.method in ("auto", "measure"):
        measure, plates, told = _by_measure(photos, views, up, settings, progress)
        notes += told
        if measure is not None:
            return _with_measure(measure, views, points, up)
        if settings.method == "measure":
            raise StageError(
                "\n".join(["no plate can be used for the scale", *(notes or ["no plate is seen"])]),
                "Put a printed plate on the floor and take 3 or more photos of it.",
            )
    notes.append(
        "no measure: the scan is UNSCALED; its unit is a guess (the wall 3 m from the cameras) "
        "and up is estimated from the cameras"
    )
    guess = typical_unit(views, points)
    world = upright_frame(views, points, guess, up)
    return world, Scale(
        method="none",
        scale=guess,
        metric=False,
        up_known=False,
        floor_known=False,
        plates=tuple(_plate_record(plate, world) for plate in plates),
        notes=tuple(notes),
    )


def _notes_on_turned(views: Sequence[View]) -> tuple[str, ...]:
    turned = turned_photos(views, up_from_cameras(views))
    if not turned:
        return ()
    listed = ", ".join(turned[:5]) + (", ..." if len(turned) > 5 else "")
    return (
        f"{len(turned)} photo(s) are turned against the others ({listed}): if the wall comes out "
        "on its side, turn the photos upright and scan again, or lay a plate on the floor",
    )


def _by_reference(
    photos: PhotoSet,
    views: Sequence[View],
    aligned: Aligned,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, Scale]:
    """Registered into a finished scan: its frame is the world, whatever a new plate says."""
    world = Similarity(1.0, np.eye(3), np.zeros(3))
    notes = [f"in the frame of the reference {aligned.reference}"]
    plates: tuple[PlateReport, ...] = ()
    if aligned.frame.metric and settings.method == "auto":
        told, plates = _against_reference(photos, views, settings, progress)
        notes += told
    return world, Scale(
        method="reference",
        scale=1.0,
        metric=aligned.frame.metric,
        up_known=aligned.frame.up_known,
        floor_known=aligned.frame.floor_known,
        plates=tuple(replace(_plate_record(plate, world), used=False) for plate in plates),
        notes=tuple(notes),
        reference_frame=aligned.reference_frame,
    )


def _against_reference(
    photos: PhotoSet, views: Sequence[View], settings: ScaleSettings, progress: Progress
) -> tuple[list[str], tuple[PlateReport, ...]]:
    """What plates in the new photos say about the reference's scale, where it differs; and the
    plates, which have no part in the frame."""
    up = up_from_cameras(views)
    try:
        measure, plates, notes = _by_measure(photos, views, up, settings, progress)
    except StageError as error:
        return [error.message], ()
    if measure is None:
        # No plate is needed here, so that one which cannot be used is not worth a line.
        return [], ()
    off = measure.world_from_model.scale - 1
    if abs(off) > MOST_DISAGREEMENT:
        notes.append(
            f"the measure in the new photos makes this frame {100 * off:+.1f} % larger than the "
            "reference says; the reference's scale is kept"
        )
    return notes, plates


def _by_distance(
    views: Sequence[View], points: Floats, up: Floats, settings: ScaleSettings
) -> tuple[Similarity, Scale]:
    marked = named_points(Path(settings.points), views) if settings.points else {}
    scale = scale_from_distance(settings.distance, views, marked)
    note = (
        f"scaled by {settings.distance} m; up is estimated from the cameras, and z = 0 is the "
        "lowest of the points, not a known floor"
    )
    return upright_frame(views, points, scale, up), Scale(
        method="distance",
        scale=scale,
        metric=True,
        up_known=False,
        floor_known=False,
        notes=(note,),
    )


def _by_measure(
    photos: PhotoSet,
    views: Sequence[View],
    up: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Measure | None, tuple[PlateReport, ...], list[str]]:
    plates = read_plates(Path(settings.plates)) if settings.plates else built_in_plates()
    plates = plates_without(plates, settings.ignore_plates)
    detections = detect_in_photos(photos, [view.name for view in views], plates, progress)
    measure, reports, notes = measure_from_plates(
        views,
        detections,
        plates,
        up,
        way=settings.way,
    )
    return measure, reports, list(notes)


def _with_measure(
    measure: Measure, views: Sequence[View], points: Floats, up: Floats
) -> tuple[Similarity, Scale]:
    scale = measure.world_from_model.scale
    world = measure.world_from_model
    if not measure.floor_known:
        world = upright_frame(views, points, scale, up)
    return world, Scale(
        method="measure",
        scale=scale,
        metric=True,
        up_known=measure.floor_known,
        floor_known=measure.floor_known,
        plates=tuple(_plate_record(plate, world) for plate in measure.plates),
        notes=tuple(measure.notes),
    )


def detect_in_photos(
    photos: PhotoSet, names: Sequence[str], plates: Sequence[Plate], progress: Progress
) -> list[Detection]:
    """Markers of the plates in photos, in the order of the names."""
    dictionaries = sorted({plate.dictionary for plate in plates})
    progress.step("look for the measure", len(names))

    def look(name: str) -> list[Detection]:
        return detect_markers(photos.read_grey(name), name, dictionaries)

    found: list[Detection] = []
    with ThreadPoolExecutor(max_workers=2) as pool:
        for detections in pool.map(look, names):
            found += detections
            progress.advance()
    return found


def plates_without(plates: Sequence[Plate], ignore: str) -> list[Plate]:
    """The plates but those whose lowest id is in `ignore` ("0,4").

    Raises
    ------
    InputError : not numbers.
    """
    try:
        ignored = {int(word) for word in ignore.split(",") if word.strip()}
    except ValueError as error:
        raise InputError(
            f"scale.ignore_plates: expected ids such as 0,4, got {ignore!r}"
        ) from error
    return [plate for plate in plates if min(plate.ids) not in ignored]


def _plate_record(plate: PlateReport, world: Similarity) -> PlateRecord:
    """A plate's entry in `scale.json`; its corners in the world frame."""
    outline = world.apply(np.array(plate.outline).reshape(-1, 3))
    corners = ((x, y, z) for x, y, z in np.round(outline, 6).tolist())
    return PlateRecord(
        ids=plate.ids,
        label=plate.label,
        used=plate.used,
        way=plate.way,
        scale=plate.scale,
        residual_mm=round(plate.residual_mm, 3),
        error_px=round(plate.error_px, 3),
        photos=plate.photos,
        problem=plate.problem,
        corners=tuple(corners),
    )


def _in_world(model: Any, world: Similarity, folder: Path) -> SparseModel:
    """The model in the world frame; a frame that is kept is not touched by a single rounding."""
    from walltopo.geometry.colmap import pycolmap

    identity = (
        world.scale == 1.0
        and np.array_equal(world.rotation, np.eye(3))
        and not world.translation.any()
    )
    if not identity:
        model.transform(
            pycolmap.Sim3d(world.scale, pycolmap.Rotation3d(world.rotation), world.translation)
        )
    folder.mkdir()
    model.write(folder)
    return SparseModel(folder)

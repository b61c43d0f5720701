"""The scale stage: metres, up and the floor; `work/sparse` to `sparse/` and `scale.json`."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, StageError, View
from walltopo.imaging.photo_file import read_grey
from walltopo.measure.contract import ScaleSettings
from walltopo.measure.from_plates import Measure, PlateReport, measure_from_plates
from walltopo.measure.known_distance import named_points, scale_from_distance
from walltopo.measure.markers import Detection, detect_markers
from walltopo.measure.plates import Plate, built_in_plates, read_plates
from walltopo.measure.upright import turned_photos, typical_unit, up_from_cameras, upright_frame
from walltopo.meshes.similarity import Similarity
from walltopo.scans.folder import ScanFolder, atomic_path, read_json, write_json
from walltopo.scans.model import open_model, read_views

__all__ = ["detect_in_photos", "plates_without", "run"]

Floats = NDArray[np.float64]


def run(scan: ScanFolder, settings: ScaleSettings, progress: Progress) -> dict[str, Any]:
    """Find the scale and write the model in the world frame.

    Returns
    -------
    Metrics: metric, method, scale, plates, residual_mm (the worst plate that was used).

    Raises
    ------
    InputError : a plates or points file, or a distance, that cannot be used.
    StageError : plates contradict each other, or `settings.method` insists on what is not there.
    """
    model = open_model(scan.sparse_raw)
    views = read_views(scan.sparse_raw)
    points = np.array([point.xyz for point in model.points3D.values()]).reshape(-1, 3)
    world, record = _decide(scan, views, points, settings, progress)
    if not record["up_known"]:
        record["notes"] += _notes_on_turned(views)
    for line in record["notes"]:
        progress.note(line)
    _write(scan, model, world, record)
    residuals = [plate["residual_mm"] for plate in record["plates"] if plate["used"]]
    return {
        "metric": record["metric"],
        "method": record["method"],
        "scale": record["scale"],
        "plates": len(residuals),
        "residual_mm": max(residuals, default=None),
    }


def _decide(
    scan: ScanFolder,
    views: Sequence[View],
    points: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, dict[str, Any]]:
    """World from model, and what goes into `scale.json`."""
    aligned = scan.aligned
    if aligned.is_file():
        return _by_reference(scan, read_json(aligned), views, settings, progress)
    up = up_from_cameras(views)
    notes: list[str] = []
    plates: tuple[PlateReport, ...] = ()
    if settings.method == "distance" and not settings.distance:
        raise InputError("scale.method=distance needs scale.distance (A-B=METRES)")
    if settings.method == "distance" or (settings.method == "auto" and settings.distance):
        return _by_distance(views, points, up, settings)
    if settings.method in ("auto", "measure"):
        measure, plates, told = _by_measure(scan, views, up, settings, progress)
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
    record = _record("none", guess, metric=False, up_known=False, floor_known=False)
    record["notes"] = notes
    world = upright_frame(views, points, guess, up)
    record["plates"] = [_plate_record(plate, world) for plate in plates]
    return world, record


def _notes_on_turned(views: Sequence[View]) -> list[str]:
    turned = turned_photos(views, up_from_cameras(views))
    if not turned:
        return []
    listed = ", ".join(turned[:5]) + (", ..." if len(turned) > 5 else "")
    return [
        f"{len(turned)} photo(s) are turned against the others ({listed}): if the wall comes out "
        "on its side, turn the photos upright and scan again, or lay a plate on the floor"
    ]


def _by_reference(
    scan: ScanFolder,
    aligned: dict[str, Any],
    views: Sequence[View],
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, dict[str, Any]]:
    """Registered into a finished scan: its frame is the world, whatever a new plate says."""
    world = Similarity(1.0, np.eye(3), np.zeros(3))
    record = _record("reference", 1.0, **aligned["frame"])
    record["notes"].append(f"in the frame of the reference {aligned['reference']}")
    if aligned["frame"]["metric"] and settings.method == "auto":
        told, plates = _against_reference(scan, views, settings, progress)
        record["notes"] += told
        record["plates"] = [{**_plate_record(plate, world), "used": False} for plate in plates]
    return world, record


def _against_reference(
    scan: ScanFolder, views: Sequence[View], settings: ScaleSettings, progress: Progress
) -> tuple[list[str], tuple[PlateReport, ...]]:
    """What plates in the new photos say about the reference's scale, where it differs; and the
    plates, which have no part in the frame."""
    up = up_from_cameras(views)
    try:
        measure, plates, notes = _by_measure(scan, views, up, settings, progress)
    except StageError as error:
        return [error.message], ()
    if measure is None:
        # No plate is needed here, so that one which cannot be used is not worth a line.
        return [], ()
    off = measure.world_from_model.scale - 1
    if abs(off) > settings.max_disagreement:
        notes.append(
            f"the measure in the new photos makes this frame {100 * off:+.1f} % larger than the "
            "reference says; the reference's scale is kept"
        )
    return notes, plates


def _by_distance(
    views: Sequence[View], points: Floats, up: Floats, settings: ScaleSettings
) -> tuple[Similarity, dict[str, Any]]:
    marked = named_points(Path(settings.points), views) if settings.points else {}
    scale = scale_from_distance(settings.distance, views, marked)
    record = _record("distance", scale, metric=True, up_known=False, floor_known=False)
    record["notes"].append(
        f"scaled by {settings.distance} m; up is estimated from the cameras, and z = 0 is the "
        "lowest of the points, not a known floor"
    )
    return upright_frame(views, points, scale, up), record


def _by_measure(
    scan: ScanFolder,
    views: Sequence[View],
    up: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Measure | None, tuple[PlateReport, ...], list[str]]:
    plates = read_plates(Path(settings.plates)) if settings.plates else built_in_plates()
    plates = plates_without(plates, settings.ignore_plates)
    detections = detect_in_photos(scan.photos, [view.name for view in views], plates, progress)
    measure, reports, notes = measure_from_plates(
        views,
        detections,
        plates,
        up,
        way=settings.way,
        max_disagreement=settings.max_disagreement,
        max_residual_mm=settings.max_residual,
    )
    return measure, reports, list(notes)


def _with_measure(
    measure: Measure, views: Sequence[View], points: Floats, up: Floats
) -> tuple[Similarity, dict[str, Any]]:
    scale = measure.world_from_model.scale
    world = measure.world_from_model
    if not measure.floor_known:
        world = upright_frame(views, points, scale, up)
    record = _record(
        "measure", scale, metric=True, up_known=measure.floor_known, floor_known=measure.floor_known
    )
    record["plates"] = [_plate_record(plate, world) for plate in measure.plates]
    record["notes"] = list(measure.notes)
    return world, record


def detect_in_photos(
    folder: Path, names: Sequence[str], plates: Sequence[Plate], progress: Progress
) -> list[Detection]:
    """Markers of the plates in photos of a folder, in the order of the names."""
    dictionaries = sorted({plate.dictionary for plate in plates})
    progress.step("look for the measure", len(names))

    def look(name: str) -> list[Detection]:
        return detect_markers(read_grey(folder / name), name, dictionaries)

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


def _record(method: str, scale: float, **flags: bool) -> dict[str, Any]:
    return {"version": 1, "method": method, "scale": scale, **flags, "plates": [], "notes": []}


def _plate_record(plate: PlateReport, world: Similarity) -> dict[str, Any]:
    """A plate's entry in `scale.json`; its corners in the world frame."""
    outline = world.apply(np.array(plate.outline).reshape(-1, 3))
    return {
        "ids": list(plate.ids),
        "label": plate.label,
        "used": plate.used,
        "way": plate.way,
        "scale": plate.scale,
        "residual_mm": round(plate.residual_mm, 3),
        "error_px": round(plate.error_px, 3),
        "photos": list(plate.photos),
        "problem": plate.problem,
        "corners": np.round(outline, 6).tolist(),
    }


def _write(scan: ScanFolder, model: Any, world: Similarity, record: dict[str, Any]) -> None:
    """The model in the world frame; a frame that is kept is not touched by a single rounding."""
    import pycolmap

    identity = (
        world.scale == 1.0
        and np.array_equal(world.rotation, np.eye(3))
        and not world.translation.any()
    )
    if not identity:
        model.transform(
            pycolmap.Sim3d(world.scale, pycolmap.Rotation3d(world.rotation), world.translation)
        )
    with atomic_path(scan.sparse) as folder:
        folder.mkdir()
        model.write(folder)
    write_json(scan.scale, record)

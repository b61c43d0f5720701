"""Run the scale stage: metres, up and the floor; `work/sparse` to `sparse/` and `scale.json`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import InputError, Progress, StageError, View
from walltopo.geometry.similarity import Similarity, rotation_with_z
from walltopo.images.markers import Detection, detect_markers, detect_stickers
from walltopo.reconstruct.scale.from_plates import (
    MAX_DISAGREEMENT,
    PlateFrame,
    PlateReport,
    frame_from_plates,
)
from walltopo.reconstruct.scale.known_distance import named_points, scale_from_distance
from walltopo.reconstruct.scale.plates import Plate, built_in_plates, read_plates, sticker
from walltopo.reconstruct.settings import ScaleSettings
from walltopo.scans.artifacts import Context
from walltopo.scans.colmap_model import SparseModel
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoSet
from walltopo.scans.poses import PosesFit
from walltopo.scans.scale import Aligned, Scale
from walltopo.scans.scale import Plate as PlateRecord

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class FrameHints:
    """The sources of the model's frame besides the photos.

    Parameters
    ----------
    aligned : the alignment to a reference, in whose frame the model is.
    poses : the fit to given poses, in whose frame the model is.
    """

    aligned: Aligned | None = None
    poses: PosesFit | None = None


def find_world(
    photos: PhotoSet,
    raw: SparseModel,
    hints: FrameHints,
    settings: ScaleSettings,
    context: Context,
) -> tuple[SparseModel, Scale, Metrics]:
    """Find the scale and transform the model into the world frame.

    Metrics: metric, method, scale, plates, residual_mm (maximum over the used plates).

    Raises
    ------
    InputError : an invalid plates file, points file or distance.
    StageError : plates contradict each other, or `settings.method` needs a plate and finds none.
    """
    model = raw.open()
    points = np.array([point.xyz for point in model.points3D.values()]).reshape(-1, 3)
    world, scale = _choose_frame(photos, raw.views, hints, points, settings, context.progress)
    if hints.poses is not None:
        scale = replace(scale, notes=scale.notes + hints.poses.notes)
    if not scale.up_known:
        scale = replace(scale, notes=scale.notes + _rotated_photos_notes(raw.views))
    for line in scale.notes:
        context.progress.note(line)
    residuals = [plate.residual_mm for plate in scale.plates if plate.used]
    return (
        _write_in_world(model, world, context.scratch / "sparse"),
        scale,
        {
            "metric": scale.metric,
            "method": scale.method,
            "scale": scale.scale,
            "plates": len(residuals),
            "residual_mm": max(residuals, default=None),
        },
    )


def _choose_frame(
    photos: PhotoSet,
    views: Sequence[View],
    hints: FrameHints,
    points: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, Scale]:
    """Return world_from_model and the scale record, by the method of the settings."""
    poses = hints.poses
    if hints.aligned is not None:
        return _frame_of_reference(photos, views, hints.aligned, settings, progress)
    up = up_from_cameras(views) if poses is None or poses.up is None else np.array(poses.up)
    if settings.method == "poses" and (poses is None or not poses.metric):
        raise InputError(
            "scale.method=poses needs sparse.poses from an app that measures metres",
            "ARKit apps such as Polycam and Record3D do; other programs do not say so.",
        )
    notes: list[str] = []
    plates: tuple[PlateReport, ...] = ()
    if settings.method == "distance" and not settings.distance:
        raise InputError("scale.method=distance needs scale.distance (A-B=METRES)")
    if settings.method == "distance" or (settings.method == "auto" and settings.distance):
        return _compared_with_poses(_frame_from_distance(views, points, up, settings), poses)
    if settings.method in ("auto", "measure"):
        measure, plates, new_notes = _detect_plate_frame(photos, views, up, settings, progress)
        notes += new_notes
        if measure is not None:
            return _compared_with_poses(_frame_of_plates(measure, views, points, up), poses)
        if settings.method == "measure":
            raise StageError(
                "\n".join(["no plate can be used for the scale", *(notes or ["no plate is seen"])]),
                "Put a printed plate on the floor and take 3 or more photos of it.",
            )
    if poses is not None and poses.metric and settings.method in ("auto", "poses"):
        return _frame_of_poses(poses, views, points, up, plates, notes)
    if settings.method == "auto":
        stuck, reports, about = _frame_of_stickers(photos, views, up, settings, progress)
        if stuck is not None:
            return _frame_of_plates(stuck, views, points, up)
        plates, notes = (*plates, *reports), [*notes, *about]
    return _guessed_unit_frame(views, points, up, plates, notes)


def _guessed_unit_frame(
    views: Sequence[View],
    points: Floats,
    up: Floats,
    plates: Sequence[PlateReport],
    notes: Sequence[str],
) -> tuple[Similarity, Scale]:
    """Return a frame of a guessed unit."""
    note = (
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
        notes=(*notes, note),
    )


_MAX_PHONE_ERROR = 0.03  # of the scale: ARKit's and ours, together


def _compared_with_poses(
    frame: tuple[Similarity, Scale], poses: PosesFit | None
) -> tuple[Similarity, Scale]:
    """Return the frame; its scale notes a measured up, and poses whose metre differs."""
    world, scale = frame
    if poses is None:
        return world, scale
    off = scale.scale - 1
    if poses.metric and abs(off) > _MAX_PHONE_ERROR:
        source = "plate" if scale.method == "measure" else "given distance"
        note = (
            f"by the {source}, lengths differ by {100 * off:+.1f} % from the poses of "
            f"{poses.path}; the {source} counts. If it is wrong, set scale.method=poses"
        )
        scale = replace(scale, notes=(*scale.notes, note))
    return world, replace(scale, up_known=scale.up_known or poses.up is not None)


def _frame_of_poses(
    poses: PosesFit,
    views: Sequence[View],
    points: Floats,
    up: Floats,
    plates: Sequence[PlateReport],
    notes: Sequence[str],
) -> tuple[Similarity, Scale]:
    """Return the frame and scale record of a phone's poses: its metres and its gravity."""
    world = upright_frame(views, points, 1.0, up)
    note = (
        f"metres{'' if poses.up is None else ' and up'} are from the poses of {poses.path}; z = 0 "
        "is the lowest of the points, not a known floor"
    )
    return world, Scale(
        method="poses",
        scale=1.0,
        metric=True,
        up_known=poses.up is not None,
        floor_known=False,
        plates=tuple(_plate_record(plate, world) for plate in plates),
        notes=(*notes, note),
    )


def _rotated_photos_notes(views: Sequence[View]) -> tuple[str, ...]:
    rotated = rotated_photos(views, up_from_cameras(views))
    if not rotated:
        return ()
    listed = ", ".join(rotated[:5]) + (", ..." if len(rotated) > 5 else "")
    return (
        f"{len(rotated)} photo(s) are turned against the others ({listed}): if the wall comes out "
        "on its side, turn the photos upright and scan again, or lay a plate on the floor",
    )


def _frame_of_reference(
    photos: PhotoSet,
    views: Sequence[View],
    aligned: Aligned,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[Similarity, Scale]:
    """Keep the frame of the reference scan, even if a plate in the new photos contradicts it."""
    world = Similarity(1.0, np.eye(3), np.zeros(3))
    notes = [f"in the frame of the reference {aligned.reference}"]
    plates: tuple[PlateReport, ...] = ()
    if aligned.frame.metric and settings.method == "auto":
        new_notes, plates = _check_against_reference(photos, views, settings, progress)
        notes += new_notes
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


def _check_against_reference(
    photos: PhotoSet, views: Sequence[View], settings: ScaleSettings, progress: Progress
) -> tuple[list[str], tuple[PlateReport, ...]]:
    """Return warnings if plates in the new photos contradict the reference, and the plate reports.

    The frame does not change.
    """
    up = up_from_cameras(views)
    try:
        measure, plates, notes = _detect_plate_frame(photos, views, up, settings, progress)
    except StageError as error:
        return [error.message], ()
    if measure is None:
        # No plate is needed here, so an unusable one needs no warning.
        return [], ()
    off = measure.world_from_model.scale - 1
    if abs(off) > MAX_DISAGREEMENT:
        notes.append(
            f"the measure in the new photos makes this frame {100 * off:+.1f} % larger than the "
            "reference says; the reference's scale is kept"
        )
    return notes, plates


def _frame_from_distance(
    views: Sequence[View], points: Floats, up: Floats, settings: ScaleSettings
) -> tuple[Similarity, Scale]:
    """Return the frame and scale record from the known distance of the settings."""
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


def _detect_plate_frame(
    photos: PhotoSet,
    views: Sequence[View],
    up: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[PlateFrame | None, tuple[PlateReport, ...], list[str]]:
    """Detect the plates in the photos; return their frame or None, the reports and notes."""
    plates = read_plates(Path(settings.plates)) if settings.plates else built_in_plates()
    plates = plates_without(plates, settings.ignore_plates)
    detections = detect_in_photos(photos, [view.name for view in views], plates, progress)
    measure, reports, notes = frame_from_plates(
        views,
        detections,
        plates,
        up,
        way=settings.way,
    )
    return measure, reports, list(notes)


_STICKER_TOLERANCE = 0.05  # relative; a sticker has few pixels
_FEWEST_STICKERS = 2


def _frame_of_stickers(
    photos: PhotoSet,
    views: Sequence[View],
    up: Floats,
    settings: ScaleSettings,
    progress: Progress,
) -> tuple[PlateFrame | None, tuple[PlateReport, ...], tuple[str, ...]]:
    """Return the frame of the stickers on the wall or None, the reports and notes."""
    names = [view.name for view in views]
    progress.step("look for stickers", len(names))
    detections = _in_photos(photos, names, detect_stickers, progress)
    stickers = [sticker(code) for code in sorted({one.marker for one in detections})]
    stickers = plates_without(stickers, settings.ignore_plates)
    try:
        frame, reports, notes = frame_from_plates(
            views, detections, stickers, up, way=settings.way, tolerance=_STICKER_TOLERANCE
        )
    except StageError as error:  # stickers are there to tie photos: a scan goes on without metres
        return None, (), (f"the stickers give no scale: {error.message}",)
    used = sum(report.used for report in reports)
    if frame is None or used < _FEWEST_STICKERS:
        return None, (), ()
    scaled = f"scaled by {used} stickers; a plate on the floor is more exact, and gives up"
    found = PlateFrame(frame.world_from_model, False, frame.plates, (scaled,), of_stickers=True)
    return found, reports, notes


def _frame_of_plates(
    measure: PlateFrame, views: Sequence[View], points: Floats, up: Floats
) -> tuple[Similarity, Scale]:
    """Return the frame and scale record of the plates; level it by the cameras without a floor
    plate."""
    scale = measure.world_from_model.scale
    world = measure.world_from_model
    if not measure.floor_known:
        world = upright_frame(views, points, scale, up)
    return world, Scale(
        method="stickers" if measure.of_stickers else "measure",
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
    """Return the markers of the plates in photos, in the order of the names."""
    dictionaries = sorted({plate.dictionary for plate in plates})

    def detect(grey: NDArray[np.uint8], name: str) -> list[Detection]:
        return detect_markers(grey, name, dictionaries)

    progress.step("look for the scale plate", len(names))
    return _in_photos(photos, names, detect, progress)


def _in_photos(
    photos: PhotoSet,
    names: Sequence[str],
    detect: Callable[[NDArray[np.uint8], str], list[Detection]],
    progress: Progress,
) -> list[Detection]:
    """Return what a detector finds in the grey photos, in the order of the names."""
    found: list[Detection] = []
    with ThreadPoolExecutor(max_workers=2) as pool:
        for detections in pool.map(lambda name: detect(photos.read_grey(name), name), names):
            found += detections
            progress.advance()
    return found


def plates_without(plates: Sequence[Plate], ignore: str) -> list[Plate]:
    """Return the plates except those whose lowest id is in `ignore` ("0,4").

    Raises
    ------
    InputError : `ignore` does not hold numbers.
    """
    try:
        ignored = {int(word) for word in ignore.split(",") if word.strip()}
    except ValueError as error:
        raise InputError(
            f"scale.ignore_plates: expected ids such as 0,4, got {ignore!r}"
        ) from error
    return [plate for plate in plates if min(plate.ids) not in ignored]


def _plate_record(plate: PlateReport, world: Similarity) -> PlateRecord:
    """Return a plate's entry in `scale.json`, with its corners in the world frame."""
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


def _write_in_world(model: Any, world: Similarity, folder: Path) -> SparseModel:
    """Write the model in the world frame; an identity transform leaves it bit-identical."""
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


TYPICAL_DISTANCE = 3.0  # metres from camera to wall, assumed in an unscaled scan
_PRIOR = 0.02  # weight of the mean up of the images against their x axes
_MIN_UP_COSINE = 0.5  # minimum cosine between the up directions of two upright photos


def up_from_cameras(views: Sequence[View]) -> Floats:
    """Return a unit up vector (3,), assuming that phones are held level, so image rows are
    horizontal.

    The estimate minimises the mean squared vertical component of the image x axes, with a weak
    prior to the mean of the images' up. The x axes alone are independent of pitch (walls are
    photographed looking up). If all photos share one heading, the mean resolves the remaining
    freedom. Photos rotated against most others (lost EXIF orientation) are ignored.
    """
    rights = np.array([view.cam_from_world[0, :3] for view in views])
    ups = np.array([-view.cam_from_world[1, :3] for view in views])
    agree = ups @ ups.T > _MIN_UP_COSINE
    group = agree[agree.sum(axis=1).argmax()]
    rights, ups = rights[group], ups[group]
    spread = rights.T @ rights / len(rights)
    up = np.linalg.solve(spread + _PRIOR * np.eye(3), ups.mean(axis=0))
    return up / np.linalg.norm(up)


def rotated_photos(views: Sequence[View], up: Floats) -> list[str]:
    """Return the photos whose own up is more than 60 degrees off: sideways or upside down."""
    return [view.name for view in views if -view.cam_from_world[1, :3] @ up < _MIN_UP_COSINE]


def typical_unit(views: Sequence[View], points: Floats) -> float:
    """Return the metres per model unit if the median point is `TYPICAL_DISTANCE` from its
    cameras."""
    depths: list[float] = []
    for view in views:
        pixels = view.project(points)  # NaN behind the camera; comparisons with NaN are False
        size = (view.camera.width, view.camera.height)
        seen = ((pixels >= 0) & (pixels <= size)).all(axis=1)
        if seen.any():
            depths.append(float(np.median(view.to_camera(points[seen])[:, 2])))
    return TYPICAL_DISTANCE / float(np.median(depths)) if depths else 1.0


def upright_frame(views: Sequence[View], points: Floats, scale: float, up: Floats) -> Similarity:
    """Return world_from_model: z up, x to the cameras' right, lowest points at z = 0.

    Parameters
    ----------
    views, points : model frame; points (n, 3).
    scale : world units per model unit.
    up : (3,) unit, model frame.
    """
    ahead = np.mean([view.direction for view in views], axis=0)
    right = np.cross(ahead, up)
    if np.linalg.norm(right) < 1e-6:
        right = views[0].cam_from_world[0, :3]
    rotation = rotation_with_z(up, right)
    cloud = points if len(points) else np.array([view.centre for view in views])
    middle = np.median(cloud @ rotation.T, axis=0)
    middle[2] = np.percentile(cloud @ rotation[2], 1)
    return Similarity(scale, rotation, -scale * middle)

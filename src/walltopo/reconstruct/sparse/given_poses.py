"""Map photos whose poses another program gave, and compare the result with them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, View
from walltopo.geometry.similarity import Similarity, fit_poses
from walltopo.reconstruct.sparse.jobs import CameraEntry, camera_entries
from walltopo.scans.photos import Photo
from walltopo.scans.poses import GivenPoses, PosesFit

Floats = NDArray[np.float64]


def posed_views(given: GivenPoses, photos: Sequence[Photo]) -> dict[str, View]:
    """Return the given views of a scan's photos by photo name, with cameras of the photos' sizes.

    Raises
    ------
    InputError : a camera is of photos of another shape.
    """
    by_source = {photo.source: photo for photo in given.photos}
    views = {}
    for photo in photos:
        found = by_source.get(photo.source)
        if found is None:
            continue
        view = found.view
        factor = photo.width / view.camera.width
        if abs(view.camera.height * factor / photo.height - 1) > 0.02:
            raise InputError(
                f"{given.path}: has the pose of {photo.source} for a photo of "
                f"{view.camera.width}x{view.camera.height} px, but it has "
                f"{photo.width}x{photo.height} px",
                "Give the photos as the app exported them, neither turned nor cropped.",
            )
        camera = view.camera.scaled(factor, photo.height / view.camera.height)
        views[photo.name] = View(photo.name, camera, view.cam_from_world)
    if len(views) < 2:
        raise InputError(
            f"{given.path}: has the poses of {len(views)} of the {len(photos)} usable photos; "
            "at least 2 are needed"
        )
    return views


_SAME_FOCAL = 0.03  # the autofocus of a phone changes its focal length by less


def posed_cameras(
    photos: Sequence[Photo], views: Mapping[str, View]
) -> tuple[list[CameraEntry], list[int]]:
    """Return the cameras and each photo's camera index.

    Posed photos of one size and nearly one focal length share a camera; a photo without a pose has
    the first of its size, else one of its own (see `camera_entries`).
    """
    groups: list[list[Camera]] = []
    of_photo: dict[str, int] = {}
    for name, view in views.items():
        same = (k for k, group in enumerate(groups) if _is_same(group[0], view.camera))
        number = next(same, len(groups))
        if number == len(groups):
            groups.append([])
        groups[number].append(view.camera)
        of_photo[name] = number
    entries = [_median_camera(group) for group in groups]
    sizes = {(entry.width, entry.height): k for k, entry in reversed(list(enumerate(entries)))}
    others, indices = camera_entries(photos)
    result = []
    own: dict[int, int] = {}
    for photo, index in zip(photos, indices, strict=True):
        number = of_photo.get(photo.name, sizes.get((photo.width, photo.height), -1))
        if number < 0:
            if index not in own:
                own[index] = len(entries)
                entries.append(others[index])
            number = own[index]
        result.append(number)
    return entries, result


def _is_same(a: Camera, b: Camera) -> bool:
    return (
        (a.width, a.height) == (b.width, b.height)
        and a.model == b.model
        and abs(a.fx / b.fx - 1) < _SAME_FOCAL
    )


def _median_camera(group: Sequence[Camera]) -> CameraEntry:
    """Return the camera of a group: the median of its parameters."""
    first = group[0]
    params = np.median([camera.params for camera in group], axis=0)
    middle = Camera(first.model, first.width, first.height, tuple(params.tolist()))
    model = first.model
    if middle.is_pinhole and abs(middle.fx / middle.fy - 1) < 0.01:
        model, params = "SIMPLE_RADIAL", np.array([middle.fx, middle.cx, middle.cy, 0.0])
    elif middle.is_pinhole:
        model = "OPENCV"
        params = np.array([middle.fx, middle.fy, middle.cx, middle.cy, 0.0, 0.0, 0.0, 0.0])
    elif model == "FULL_OPENCV" and not any(middle.distortion[4:]):
        model, params = "OPENCV", params[:8]  # its lens can be adjusted (see `posed`)
    return CameraEntry(model, first.width, first.height, tuple(params.tolist()), True)


def write_posed_model(
    photos: Sequence[Photo],
    views: Mapping[str, View],
    cameras: Sequence[CameraEntry],
    indices: Sequence[int],
    folder: Path,
) -> str:
    """Write a COLMAP model of the given poses without points, with the ids of the database."""
    from walltopo.geometry.colmap import pycolmap

    model = pycolmap.Reconstruction()
    used = {indices[k] for k, photo in enumerate(photos) if photo.name in views}
    for index in sorted(used):
        entry = cameras[index]
        camera = pycolmap.Camera(
            model=entry.model, width=entry.width, height=entry.height, params=list(entry.params)
        )
        camera.camera_id = index + 1
        model.add_camera_with_trivial_rig(camera)
    for number, photo in enumerate(photos, start=1):
        view = views.get(photo.name)
        if view is not None:
            camera_id = indices[number - 1] + 1
            image = pycolmap.Image(name=photo.name, camera_id=camera_id, image_id=number)
            model.add_image_with_trivial_frame(image, pycolmap.Rigid3d(view.cam_from_world))
    folder.mkdir(parents=True, exist_ok=True)
    model.write(folder)
    return str(folder)


_MIN_PLACED = 0.3  # share of the posed photos that must see points of others

_WARN_SHARE = 0.03  # of the extent of the cameras
_WARN_DEG = 2.0


def into_frame_of_poses(model: Any, given: GivenPoses, views: Mapping[str, View]) -> PosesFit:
    """Move a model into the frame of the given poses, in place; return how both agree.

    Raises
    ------
    InputError : too few posed photos are in the model, or both have nothing in common.
    """
    from walltopo.geometry.colmap import pycolmap

    found = {str(image.name): image for image in model.images.values() if image.has_pose}
    names = sorted(found.keys() & views.keys())
    if len(names) < max(2, _MIN_PLACED * len(views)):
        raise contradiction_error(given)
    target = np.array([views[name].cam_from_world for name in names])
    source = np.array([found[name].cam_from_world().matrix() for name in names])
    fit = fit_poses(source, target)
    model.transform(pycolmap.Sim3d(fit.scale, pycolmap.Rotation3d(fit.rotation), fit.translation))
    centres = np.array([views[name].centre for name in names])
    moved = np.array([found[name].projection_center() for name in names])
    away = np.linalg.norm(moved - centres, axis=1)
    turned = _turn_degrees(source, target, fit)
    result = PosesFit(
        app=given.app,
        path=given.path,
        metric=given.metric,
        up=given.up,
        posed=len(views),
        placed=len(names),
        median=float(np.median(away)),
        worst=float(away.max()),
        median_deg=float(np.median(turned)),
        extent=float(np.linalg.norm(np.ptp(centres, axis=0))),
    )
    return _with_notes(result, names[int(away.argmax())])


def _turn_degrees(source: Floats, target: Floats, fit: Similarity) -> Floats:
    """Return (n,) by how much each camera is turned against the given one, degrees."""
    both = target[:, :, :3] @ (fit.rotation @ np.swapaxes(source[:, :, :3], 1, 2))
    cosine = np.clip((np.trace(both, axis1=1, axis2=2) - 1) / 2, -1, 1)
    return np.asarray(np.degrees(np.arccos(cosine)))


def _with_notes(fit: PosesFit, worst: str) -> PosesFit:
    """Return the fit with notes where the photos contradict the poses."""
    from msgspec.structs import replace

    notes = []
    unit = "m" if fit.metric else "units of the file"
    if fit.placed < fit.posed:
        notes.append(
            f"{fit.posed - fit.placed} of {fit.posed} photos see too little of what others see "
            f"from their poses in {fit.path}; these poses were not used"
        )
    if fit.median > _WARN_SHARE * fit.extent or fit.median_deg > _WARN_DEG:
        notes.append(
            f"the photos contradict the poses of {fit.path}: cameras are {fit.median:.3f} {unit} "
            f"and {fit.median_deg:.1f} degrees away (median; worst {fit.worst:.3f} {unit}: "
            f"{worst}); a scale from them may be wrong: lay a plate on the floor"
        )
    return replace(fit, notes=tuple(notes))


def contradiction_error(given: GivenPoses) -> InputError:
    """Return the error for poses that do not belong to the photos."""
    return InputError(
        f"{given.path}: its poses do not fit the photos: what several photos show does not meet "
        f"at one place from the {len(given.photos)} poses",
        "Check that the poses are of these photos (names, order, not turned or cropped), or scan "
        "without --poses.",
    )

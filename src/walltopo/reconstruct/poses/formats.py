"""The known formats of poses: find which one a path has, and read it for a scan's photos."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.core.files import as_text
from walltopo.geometry.screen import valid_slope
from walltopo.geometry.similarity import Similarity
from walltopo.reconstruct.poses import (
    colmap,
    metashape,
    nerfstudio,
    polycam,
    realityscan,
    record3d,
)
from walltopo.reconstruct.poses.export import Export, PhotoFiles
from walltopo.scans.poses import GivenPoses, MeshFrame, PosedPhoto

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Format:
    """One format.

    Parameters
    ----------
    name : the word for it on the command line; title : for people.
    find_poses : returns the poses at or in a path, None without any.
    find_photos : returns the folder of the photos of some poses, None without one.
    read : reads the poses.
    """

    name: str
    title: str
    find_poses: Callable[[Path], Path | None]
    find_photos: Callable[[Path], Path | None]
    read: Callable[[Path, PhotoFiles], Export]


FORMATS = tuple(
    Format(name, title, module.find_poses, module.find_photos, module.read)
    for name, title, module in (
        ("polycam", "Polycam raw export (ARKit)", polycam),
        ("record3d", "Record3D", record3d),
        ("nerfstudio", "nerfstudio transforms.json", nerfstudio),
        ("realityscan", "RealityScan (RealityCapture)", realityscan),
        ("metashape", "Metashape cameras XML", metashape),
        ("colmap", "COLMAP model", colmap),
    )
)


def format_named(name: str) -> Format:
    """Return the format of a name; raise InputError for others."""
    for item in FORMATS:
        if item.name == name:
            return item
    known = ", ".join(item.name for item in FORMATS)
    raise InputError(f"no format {name!r}; the formats are {known}")


def find_format(path: Path) -> tuple[Format, Path]:
    """Return the first format whose poses are at or in a path, and the poses.

    Raises
    ------
    InputError : the path does not exist, or no format is found there.
    """
    if not path.exists():
        raise InputError(f"{path}: no such file or folder")
    for item in FORMATS:
        poses = item.find_poses(path)
        if poses is not None:
            return item, poses
    known = "; ".join(item.title for item in FORMATS)
    raise InputError(f"{path}: holds no camera poses that are read here", f"Known are: {known}.")


def check_lens(camera: Camera) -> None:
    """Raise InputError if a lens shows a direction twice within the middle of its photo.

    The polynomial of a real calibration may fold back outside of the photo or in its corners. One
    that folds within half of the shorter side belongs to another unit or another model.
    """
    slope = valid_slope(camera)
    if not np.isfinite(slope):
        return
    ray = np.array([slope, 0.0, 1.0])
    radius = float(camera.project(ray)[0] - camera.cx)
    if radius < min(camera.width, camera.height) / 2:
        lens = ", ".join(f"{value:g}" for value in camera.distortion)
        raise InputError(
            f"the lens of {camera.model} ({lens}) folds back {max(radius, 0):.0f} px from the "
            f"middle of a photo of {camera.width}x{camera.height} px",
            "Check that the lens parameters are for this model and not in pixels; or undistort "
            "the photos, then all are 0.",
        )


def read_poses(path: Path, photos: Sequence[Path]) -> GivenPoses:
    """Return the poses at or in a path for the photos of a scan.

    Raises
    ------
    InputError : no known format, a damaged file, no pose of any of the photos, or an impossible
        lens.
    """
    item, poses = find_format(path)
    files = PhotoFiles(tuple(photos))
    export = item.read(poses, files)
    posed: dict[Path, View] = {}
    others = 0
    for view in export.views:
        photo = files.find(view.name)
        if photo is None:
            others += 1
        elif photo in posed:
            raise InputError(f"{poses}: has two poses for {as_text(photo.name)}")
        else:
            with prefix_errors(f"{poses}: {as_text(photo.name)}"):
                check_lens(view.camera)
            posed[photo] = _upright_view(view, files, photo)
    if not posed:
        raise InputError(
            f"{poses}: none of its {len(export.views)} poses is of one of the {len(photos)} photos "
            f"(such as {as_text(photos[0].name) if photos else 'none'})",
            "Give the photos that the app exported with the poses; names must agree.",
        )
    origin = _local_origin(list(posed.values()))
    frame = export.mesh_frame
    if any(origin):
        frame = frame or Similarity(1.0, np.eye(3), np.zeros(3))
        frame = Similarity(frame.scale, frame.rotation, frame.apply(origin))
    return GivenPoses(
        app=item.name,
        path=as_text(poses),
        metric=export.metric,
        up=export.up,
        photos=tuple(PosedPhoto.of(_shift_origin(view, origin)) for view in posed.values()),
        others=others,
        mesh_frame=None if frame is None else MeshFrame.of(frame),
        origin=(float(origin[0]), float(origin[1]), float(origin[2])),
    )


# Map coordinates (UTM, Gauss-Krueger) begin here; a gym in a frame of its own is far smaller.
_FAR = 10_000.0


def _local_origin(views: Sequence[View]) -> Floats:
    """Return the (3,) whole point near the cameras that becomes the origin; zero if they are near.

    Far from the origin, the single precision of meshes and textures is centimetres.
    """
    middle = np.round(np.median([view.centre for view in views], axis=0))
    return middle if np.abs(middle).max() >= _FAR else np.zeros(3)


def _shift_origin(view: View, origin: Floats) -> View:
    """Return a view in the frame whose origin is a point of the present one."""
    pose = view.cam_from_world.copy()
    pose[:, 3] += pose[:, :3] @ origin
    return View(view.name, view.camera, pose)


# EXIF's orientation to the quarter turns, clockwise, that make a photo upright; mirrored
# orientations do not come from cameras.
_TURNS = {3: 2, 6: 1, 8: 3}


def _upright_view(view: View, files: PhotoFiles, photo: Path) -> View:
    """Return a view of the photo as `ingest` turns it upright, named as the user's file.

    Programs give poses for the pixels as stored; one whose size is that of the upright photo has
    turned it already.
    """
    camera = view.camera
    turns = _TURNS.get(files.orientation(photo), 0)
    wide = camera.width > camera.height
    stored = files.stored_size(photo)
    if turns % 2 and wide != (stored[0] > stored[1]):
        turns = 0
    pose = view.cam_from_world
    for _ in range(turns):
        camera, pose = _turned_camera(camera), _QUARTER @ pose
    return View(as_text(photo.name), camera, pose)


# The camera axes of a photo turned clockwise: its right is the old up, its down the old right.
_QUARTER = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])


def _turned_camera(camera: Camera) -> Camera:
    """Return the camera of a photo that was turned by 90 degrees clockwise."""
    full = list(camera.params)
    if camera.fx != camera.fy or camera.model in ("PINHOLE", "OPENCV", "FULL_OPENCV"):
        full[0], full[1] = camera.fy, camera.fx
    at = len(full) - len(camera.distortion) - 2
    full[at], full[at + 1] = camera.height - camera.cy, camera.cx
    if camera.model in ("OPENCV", "FULL_OPENCV"):
        # Tangential distortion turns like a vector (p2, p1).
        p1, p2 = full[6], full[7]
        full[6], full[7] = p2, -p1
    return Camera(camera.model, camera.height, camera.width, tuple(full))

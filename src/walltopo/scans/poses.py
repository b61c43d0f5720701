"""`poses.json`: the poses that another program gave for a scan's photos."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Self

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import prefix_errors
from walltopo.geometry.similarity import Similarity, nearest_rotation
from walltopo.scans.document import Coordinate, Document, Side, check_once

Floats = NDArray[np.float64]
Point = tuple[Coordinate, Coordinate, Coordinate]
Row = tuple[Coordinate, Coordinate, Coordinate, Coordinate]
Number = Annotated[float, msgspec.Meta(ge=-1e9, le=1e9)]

# OpenGL's and ARKit's cameras look along -z with y up; COLMAP's look along +z with y down.
_FLIP = np.diag([1.0, -1.0, -1.0])


class PosedPhoto(msgspec.Struct, frozen=True):
    """The pose of one photo.

    Parameters
    ----------
    source : file name of the user's photo.
    model, width, height, params : the camera in COLMAP's terms, for the upright photo.
    cam_from_world : rotation | translation, from the frame of the poses to COLMAP's camera axes.
    """

    source: str
    model: str
    width: Side
    height: Side
    params: tuple[Number, ...]
    cam_from_world: tuple[Row, Row, Row]

    @classmethod
    def of(cls, view: View) -> PosedPhoto:
        """Return the entry of a view whose name is the user's file."""
        a, b, c = (tuple(row) for row in view.cam_from_world.tolist())
        camera = view.camera
        return cls(view.name, camera.model, camera.width, camera.height, camera.params, (a, b, c))

    @property
    def view(self) -> View:
        """Return the photo as a view in the frame of the poses, named as the user's file."""
        camera = Camera(self.model, self.width, self.height, self.params)
        return View(self.source, camera, np.array(self.cam_from_world))


def _point(values: Floats) -> Point:
    x, y, z = values.tolist()
    return x, y, z


class MeshFrame(msgspec.Struct, frozen=True):
    """The similarity from the frame of the poses to that of the mesh of the same export.

    Parameters
    ----------
    scale, rotation (rows), translation : as in `Similarity`.
    """

    scale: Number
    rotation: tuple[Point, Point, Point]
    translation: tuple[Number, Number, Number]

    @classmethod
    def of(cls, frame: Similarity) -> MeshFrame:
        """Return the entry of a transform."""
        a, b, c = (_point(row) for row in frame.rotation)
        return cls(frame.scale, (a, b, c), _point(frame.translation))

    @property
    def similarity(self) -> Similarity:
        """Return the transform."""
        return Similarity(self.scale, np.array(self.rotation), np.array(self.translation))


class GivenPoses(Document, frozen=True, kw_only=True):
    """`poses.json`.

    Parameters
    ----------
    app : name of the format, such as "polycam".
    path : the file or folder that was read.
    metric : whether the unit is a metre.
    up : unit vector in the frame of the poses, if the app measured gravity.
    photos : the posed photos among the scan's, by name.
    others : number of poses in the file whose photo is not among the scan's.
    mesh_frame : where the app's own mesh is, if in another frame.
    origin : point of the file's frame that is 0 0 0 here; not zero for coordinates such as UTM.
    """

    app: str
    path: str
    metric: bool
    up: Point | None
    photos: tuple[PosedPhoto, ...]
    others: int = 0
    mesh_frame: MeshFrame | None = None
    origin: tuple[Number, Number, Number] = (0.0, 0.0, 0.0)

    @classmethod
    def load(cls, path: Path) -> Self:
        """Return the checked content; raise InputError also for invalid cameras and poses."""
        poses = super().load(path)
        with prefix_errors(path):
            check_once("a photo named", (photo.source for photo in poses.photos))
            for photo in poses.photos:
                _ = photo.view
        return poses


class PosesFit(Document, frozen=True, kw_only=True):
    """`work/poses-fit.json`: how the reconstruction agrees with the given poses.

    The reconstruction is in the frame of the poses: the fitted similarity was applied to it.

    Parameters
    ----------
    app, path, metric, up : as in `GivenPoses`.
    posed : photos with a pose; placed : those among them that the reconstruction starts from.
    median, worst : distances of the camera centres to the given ones, in the unit of the poses.
    median_deg : the same for the directions of the cameras, degrees.
    extent : diagonal of the box around the given camera centres, in the unit of the poses.
    notes : contradictions, for people.
    """

    app: str
    path: str
    metric: bool
    up: Point | None
    posed: int
    placed: int
    median: float
    worst: float
    median_deg: float
    extent: float
    notes: tuple[str, ...] = ()


def posed_view(name: str, camera: Camera, world_from_cam: Floats, *, opengl: bool) -> View:
    """Return a view from the pose of its camera in the world.

    Parameters
    ----------
    world_from_cam : (3, 4) or (4, 4) float.
    opengl : the camera looks along -z with y up, as in OpenGL and ARKit; else as in COLMAP.

    Raises
    ------
    InputError : the matrix mirrors, is not finite or is not a rotation and a position.
    """
    pose = np.asarray(world_from_cam, dtype=np.float64)
    if pose.shape not in ((3, 4), (4, 4)) or not np.isfinite(pose).all():
        raise InputError(f"the pose must be 3 or 4 rows of four finite numbers, got {pose.shape}")
    if not np.allclose(pose[3:], [0, 0, 0, 1]):
        raise InputError("the last row of the pose must be 0 0 0 1")
    volume = float(np.linalg.det(pose[:3, :3]))
    if not 1e-12 < volume < 1e12:
        what = "mirrors" if volume < 0 else "is not a rotation"
        raise InputError(
            f"the pose {what} (determinant {volume:.3g}); expected rotation and position",
            "A mirrored camera has one axis flipped: check the exporter's convention.",
        )
    # Some exporters leave a scale in the matrix, and most write few digits.
    rotation = pose[:3, :3] / np.cbrt(volume)
    nearest = nearest_rotation(rotation)
    if np.abs(rotation - nearest).max() > 0.01:
        raise InputError("the pose is not a rigid transform: its axes are not at right angles")
    rotation = nearest @ _FLIP if opengl else nearest
    with prefix_errors(name):
        return View(name, camera, np.column_stack([rotation.T, -rotation.T @ pose[:3, 3]]))

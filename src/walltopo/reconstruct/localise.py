"""Find the camera of a picture in a scan, by learned features of the scan's photos.

Each feature of a photo gets the point of the mesh behind it. A picture's features are matched with
those of the photos most similar to it (XFeat and LighterGlue); its pose follows from the matched
points (PnP in RANSAC, then refined). This is hierarchical localisation (Sarlin et al., "From Coarse
to Fine", 2019) with the count of mutual neighbours as the coarse step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError, Mesh, View
from walltopo.core.parallel import available_cores
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.scale.known_distance import undistort
from walltopo.reconstruct.sparse.learned_features import Features, XFeat, count_mutual_neighbours

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Bitmap = NDArray[np.bool_]

_FEATURES: Final = 1024  # of each photo and picture; 2048 take five times as long to match
_PHOTOS: Final = 4  # most similar photos that a picture is matched with
_MAX_ERROR_PX: Final = 8.0  # of an inlier, in a picture whose longer side is _SIDE
_SIDE: Final = 1280
_FOCAL: Final = 1.1  # of an unknown camera, in longer sides, before it is estimated
MIN_INLIERS: Final = 30


@dataclass(frozen=True, eq=False)
class _Landmarks:
    """The features of a photo that lie on the mesh, and their (n, 3) points in the world frame."""

    features: Features
    points: Floats


@dataclass(frozen=True, eq=False)
class Location:
    """The camera of a picture in the frame of a scan.

    Parameters
    ----------
    camera : a SIMPLE_PINHOLE camera, or the one that was given.
    cam_from_world : (3, 4), in the scan's unit; COLMAP's axes.
    pixels : (n, 2) of the features that agree. points : (n, 3) their points on the mesh.
    """

    camera: Camera
    cam_from_world: Floats
    pixels: Floats
    points: Floats


class Localiser:
    """Finds cameras of pictures in one scan.

    Parameters
    ----------
    views : the scan's registered photos.
    mesh : of the scan, in the same frame.
    read : returns a photo's (H, W, 3) uint8 pixels by the view's name.
    hidden : returns the (H, W) bool pixels of people in a photo by its name, None without any.

    Attributes
    ----------
    bvh : of the mesh.
    """

    def __init__(
        self,
        views: Sequence[View],
        mesh: Mesh,
        read: Callable[[str], Image],
        hidden: Callable[[str], Bitmap | None] = lambda _: None,
    ) -> None:
        if not views:
            raise InputError("the scan has no registered photos")
        self._network = XFeat()
        self.bvh = Bvh(mesh.vertices, mesh.faces)

        def landmarks(view: View) -> _Landmarks:
            found = self.find_features(read(view.name), hidden(view.name))
            return _on_mesh(view, found, self.bvh)

        with ThreadPoolExecutor(available_cores()) as pool:
            self._photos = list(pool.map(landmarks, views))

    def find_features(self, picture: Image, hidden: Bitmap | None = None) -> Features:
        """Return the features of a picture outside `hidden`, (H, W) bool pixels."""
        features = self._network.find(picture, _FEATURES)
        if hidden is None:
            return features
        column, row = np.floor(features.xy).astype(np.int64).T
        height, width = hidden.shape
        kept = ~hidden[row.clip(0, height - 1), column.clip(0, width - 1)]
        return Features(features.xy[kept], features.descriptors[kept], features.size)

    def localise(self, features: Features, camera: Camera | None = None) -> Location | None:
        """Return the camera of a picture, or None if fewer than `MIN_INLIERS` points agree.

        Parameters
        ----------
        features : of the picture. camera : its intrinsics; by default a focal length is estimated.
        """
        pixels, points = self._matches(features)
        return solve_pose(pixels, points, features.size, camera)

    def _matches(self, features: Features) -> tuple[Floats, Floats]:
        """Return pixels (n, 2) and mesh points (n, 3) that may belong together."""
        similar = [count_mutual_neighbours(features, photo.features) for photo in self._photos]
        best = np.argsort(-np.array(similar), kind="stable")[:_PHOTOS]
        pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
        for number in best.tolist():
            photo = self._photos[number]
            pairs = self._network.match(features, photo.features)
            pixels.append(features.xy[pairs[:, 0]].astype(np.float64))
            points.append(photo.points[pairs[:, 1]])
        return np.concatenate(pixels), np.concatenate(points)


def solve_pose(
    pixels: Floats, points: Floats, size: tuple[int, int], camera: Camera | None
) -> Location | None:
    """Return the camera that projects points onto pixels, or None if too few agree.

    Parameters
    ----------
    pixels : (n, 2). points : (n, 3), world frame. size : width and height of the picture.
    camera : None if the focal length is not known.
    """
    from walltopo.geometry.colmap import pycolmap

    if len(pixels) < MIN_INLIERS:
        return None
    width, height = size
    start = camera or Camera(
        "SIMPLE_PINHOLE", width, height, (_FOCAL * max(size), width / 2, height / 2)
    )
    estimation = pycolmap.AbsolutePoseEstimationOptions()
    estimation.estimate_focal_length = camera is None
    estimation.ransac.max_error = _MAX_ERROR_PX * max(size) / _SIDE
    estimation.ransac.random_seed = 0
    refinement = pycolmap.AbsolutePoseRefinementOptions()
    refinement.refine_focal_length = camera is None
    lens = pycolmap.Camera(
        model=start.model, width=width, height=height, params=np.array(start.params)
    )
    found = pycolmap.estimate_and_refine_absolute_pose(pixels, points, lens, estimation, refinement)
    if found is None or found["num_inliers"] < MIN_INLIERS:
        return None
    kept = np.asarray(found["inlier_mask"], np.bool_)
    solved = Camera(start.model, width, height, tuple(float(v) for v in lens.params))
    pose = np.asarray(found["cam_from_world"].matrix(), np.float64)
    return Location(solved, pose, pixels[kept], points[kept])


def _on_mesh(view: View, features: Features, bvh: Bvh) -> _Landmarks:
    """Return the features of a photo that lie on the mesh, with their points."""
    pixels = features.xy.astype(np.float64)
    if len(pixels) == 0:
        return _Landmarks(features, np.zeros((0, 3)))
    local = np.column_stack([undistort(view.camera, pixels), np.ones(len(pixels))])
    ways = local @ view.cam_from_world[:, :3]
    origins = np.broadcast_to(view.centre, ways.shape)
    face, along = bvh.first_hit(origins, ways)
    hit = face >= 0
    kept = Features(features.xy[hit], features.descriptors[hit], features.size)
    return _Landmarks(kept, view.centre + along[hit, None] * ways[hit])

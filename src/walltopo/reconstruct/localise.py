"""Find the camera of a picture in a scan, by learned features of the scan's photos.

Each feature of a photo gets the point of the mesh behind it. A picture's features are matched with
those of the photos most similar to it (XFeat and LighterGlue); its pose follows from the matched
points (PnP in RANSAC, then refined). This is hierarchical localisation (Sarlin et al., "From Coarse
to Fine", 2019) with the count of mutual neighbours as the coarse step.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Camera, InputError
from walltopo.geometry.rays import Bvh
from walltopo.reconstruct.landmarks import Landmarks, find_features
from walltopo.reconstruct.sparse.feature_sets import Features, count_mutual_neighbours
from walltopo.reconstruct.sparse.learned_features import XFeat

Floats = NDArray[np.float64]
Image = NDArray[np.uint8]
Bitmap = NDArray[np.bool_]

_PHOTOS: Final = 4  # most similar photos that a picture is matched with
_MAX_ERROR_PX: Final = 8.0  # of an inlier, in a picture whose longer side is _SIDE
_SIDE: Final = 1280
_FOCAL: Final = 1.1  # of an unknown camera, in longer sides, before it is estimated
MIN_INLIERS: Final = 30


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
    photos : the landmarks of the scan's photos. bvh : of its mesh.

    Raises
    ------
    InputError : there are no photos.
    """

    def __init__(self, photos: Sequence[Landmarks], bvh: Bvh) -> None:
        if not photos:
            raise InputError("the scan has no registered photos")
        self._network = XFeat()
        self.photos = photos
        self.bvh = bvh

    def find_features(self, picture: Image, hidden: Bitmap | None = None) -> Features:
        """Return the features of a picture outside `hidden`, (H, W) bool pixels."""
        return find_features(self._network, picture, hidden)

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
        similar = [count_mutual_neighbours(features, photo.features) for photo in self.photos]
        best = np.argsort(-np.array(similar), kind="stable")[:_PHOTOS]
        pixels, points = [np.zeros((0, 2))], [np.zeros((0, 3))]
        for number in best.tolist():
            photo = self.photos[number]
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

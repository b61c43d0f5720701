"""Up, heading and a plausible unit where no measure tells them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.geometry.similarity import Similarity, rotation_with_z

Floats = NDArray[np.float64]

TYPICAL_DISTANCE = 3.0  # metres from camera to wall, the guess of an unscaled scan
_PRIOR = 0.02
_TURNED = 0.5  # cosine of the angle at which two photos count as turned against each other


def up_from_cameras(views: Sequence[View]) -> Floats:
    """A unit up vector (3,): people hold phones level, so image rows are horizontal.

    Minimises the mean squared vertical part of the image x axes, drawn weakly to the mean of
    the images' up. The axes alone are blind to pitch (a wall is photographed looking up), the
    mean alone is not; with photos of one heading, the mean decides what the axes leave open.
    Photos turned against most others (a phone held sideways whose EXIF is lost) have no say.
    """
    rights = np.array([view.cam_from_world[0, :3] for view in views])
    ups = np.array([-view.cam_from_world[1, :3] for view in views])
    agree = ups @ ups.T > _TURNED
    group = agree[agree.sum(axis=1).argmax()]
    rights, ups = rights[group], ups[group]
    spread = rights.T @ rights / len(rights)
    up = np.linalg.solve(spread + _PRIOR * np.eye(3), ups.mean(axis=0))
    return up / np.linalg.norm(up)


def turned_photos(views: Sequence[View], up: Floats) -> list[str]:
    """Names of photos whose own up is more than 60 degrees off: sideways or upside down."""
    return [view.name for view in views if -view.cam_from_world[1, :3] @ up < _TURNED]


def typical_unit(views: Sequence[View], points: Floats) -> float:
    """Metres per model unit if the median point lies `TYPICAL_DISTANCE` from its cameras."""
    depths: list[float] = []
    for view in views:
        pixels = view.project(points)  # NaN behind the camera, which no comparison passes
        size = (view.camera.width, view.camera.height)
        seen = ((pixels >= 0) & (pixels <= size)).all(axis=1)
        if seen.any():
            depths.append(float(np.median(view.to_camera(points[seen])[:, 2])))
    return TYPICAL_DISTANCE / float(np.median(depths)) if depths else 1.0


def upright_frame(views: Sequence[View], points: Floats, scale: float, up: Floats) -> Similarity:
    """World from model: z up, x to the right as the cameras look, lowest points at z = 0.

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

"""A view: camera, pose and masks of one photo."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core.camera import Camera
from walltopo.core.errors import InputError
from walltopo.core.mask import Mask

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class View:
    """One posed photo with what was detected in it.

    Parameters
    ----------
    name : the photo's file name.
    camera : intrinsics.
    cam_from_world : (3, 4) float, rotation | translation; world metres to the camera frame of
        COLMAP (x right, y down, z forward).
    masks : the masks of the photo.

    Examples
    --------
    A camera at the origin that looks along z:

    >>> import numpy as np
    >>> from walltopo.core import Camera
    >>> camera = Camera("PINHOLE", 640, 480, (520.0, 520.0, 320.0, 240.0))
    >>> view = View("IMG_0001.jpg", camera, np.eye(4)[:3])
    >>> view.direction.tolist()
    [0.0, 0.0, 1.0]
    """

    name: str
    camera: Camera
    cam_from_world: Floats
    masks: tuple[Mask, ...] = field(default=())

    def __post_init__(self) -> None:
        pose = np.ascontiguousarray(self.cam_from_world, dtype=np.float64)
        if pose.shape != (3, 4):
            raise InputError(f"{self.name}: cam_from_world: expected (3, 4), got {pose.shape}")
        rotation = pose[:, :3]
        if not np.isfinite(pose).all() or np.abs(rotation @ rotation.T - np.eye(3)).max() > 1e-4:
            raise InputError(f"{self.name}: cam_from_world is not a finite rigid transform")
        object.__setattr__(self, "cam_from_world", pose)

    @property
    def centre(self) -> Floats:
        """(3,) camera centre in the world frame."""
        return -self.cam_from_world[:, :3].T @ self.cam_from_world[:, 3]

    @property
    def direction(self) -> Floats:
        """(3,) unit viewing direction (camera z axis) in the world frame."""
        return self.cam_from_world[2, :3].copy()

    def to_camera(self, points: Floats) -> Floats:
        """World points (..., 3) in the camera frame."""
        return points @ self.cam_from_world[:, :3].T + self.cam_from_world[:, 3]

    def project(self, points: Floats) -> Floats:
        """Pixels (..., 2) of world points (..., 3); NaN behind the camera."""
        return self.camera.project(self.to_camera(points))

    def with_masks(self, masks: tuple[Mask, ...]) -> View:
        """The same view with other masks."""
        return replace(self, masks=masks)

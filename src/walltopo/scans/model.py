"""COLMAP models: the cameras and poses of `sparse/`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Camera, InputError, View

__all__ = ["open_model", "read_views", "view_of_image"]


def open_model(path: Path) -> Any:
    """The `pycolmap.Reconstruction` in a folder.

    Raises
    ------
    InputError : the folder holds no COLMAP model, or it cannot be read.
    """
    import pycolmap

    path = Path(path)
    if not any((path / f"images{suffix}").is_file() for suffix in (".bin", ".txt")):
        raise InputError(
            f"{path}: no COLMAP model here (cameras, images and points3D as .bin or .txt)"
        )
    try:
        return pycolmap.Reconstruction(path)
    except (RuntimeError, ValueError) as error:
        raise InputError(f"{path}: the COLMAP model cannot be read: {error}") from error


def view_of_image(image: Any) -> View:
    """A `View` without masks of a registered `pycolmap.Image`."""
    camera = image.camera
    pose = image.cam_from_world
    pose = pose() if callable(pose) else pose
    intrinsics = Camera(
        camera.model.name,
        int(camera.width),
        int(camera.height),
        tuple(float(p) for p in camera.params),
    )
    return View(str(image.name), intrinsics, np.asarray(pose.matrix(), dtype=np.float64))


def read_views(path: Path) -> list[View]:
    """The registered photos of a COLMAP model as views without masks, sorted by name.

    Raises
    ------
    InputError : see `open_model`; or the model has no registered photo.
    """
    model = open_model(path)
    views = [view_of_image(image) for image in model.images.values() if image.has_pose]
    if not views:
        raise InputError(f"{path}: the COLMAP model has no registered photo")
    return sorted(views, key=lambda view: view.name)

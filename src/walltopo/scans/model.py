"""COLMAP models: the cameras, poses and points of `sparse/`."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from walltopo.core import Camera, InputError, View
from walltopo.core.errors import naming
from walltopo.core.files import move_into_place
from walltopo.core.inside import check_name
from walltopo.scans.bounds import check_once
from walltopo.scans.model_files import check_model_files

if TYPE_CHECKING:
    from walltopo.colmap import pycolmap

__all__ = ["SparseModel", "open_model", "read_views", "view_of_image"]


@dataclass(frozen=True, eq=False)
class SparseModel:
    """A folder with a COLMAP model."""

    folder: Path

    @classmethod
    def load(cls, path: Path) -> SparseModel:
        """The folder; InputError where it holds no model (see `open_model`)."""
        _check_model(path)
        return cls(path)

    def save(self, path: Path) -> None:
        """Move the folder to `path`, atomically."""
        move_into_place(self.folder, path)

    @cached_property
    def views(self) -> tuple[View, ...]:
        """The registered photos without masks, sorted by name."""
        return tuple(read_views(self.folder))

    def open(self) -> pycolmap.Reconstruction:
        """The model, read anew at each call: COLMAP's functions change it in place."""
        return open_model(self.folder)


def _check_model(path: Path) -> None:
    if not any((path / f"images{suffix}").is_file() for suffix in (".bin", ".txt")):
        raise InputError(
            f"{path}: no COLMAP model here (cameras, images and points3D as .bin or .txt)"
        )


def open_model(path: Path) -> pycolmap.Reconstruction:
    """The model in a folder.

    Raises
    ------
    InputError : the folder holds no COLMAP model, or it cannot be read; a photo's name leads out
        of its folder, or its pose or camera is none.
    """
    from walltopo.colmap import pycolmap

    path = Path(path)
    _check_model(path)
    check_model_files(path)
    try:
        model = pycolmap.Reconstruction(path)
        with naming(path):
            _check_images(model)
    except (IndexError, MemoryError, RuntimeError, ValueError) as error:
        raise InputError(f"{path}: the COLMAP model cannot be read: {error}") from error
    return model


def _check_images(model: pycolmap.Reconstruction) -> None:
    """Refuse photos whose name, pose or camera is none."""
    names = [str(image.name) for image in model.images.values()]
    check_once("a photo called", names)
    for name in names:
        check_name(name)
    for image in model.images.values():
        if image.has_pose:
            view_of_image(image)


def view_of_image(image: pycolmap.Image) -> View:
    """A `View` without masks of a registered image."""
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

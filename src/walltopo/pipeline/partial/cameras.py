"""Join the COLMAP models of a wall and of a partial rescan in the same frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.reconstruct.sparse.models import KeptImage, copy_image, rebuild

if TYPE_CHECKING:
    from walltopo.geometry.colmap import pycolmap

Flags = NDArray[np.bool_]

MIN_SHARE: Final = 0.05  # share of a photo's triangles that must stay, for the photo to stay
_SIDE: Final = 400  # pixels, longer side of the rendered photos


def photos_still_valid(mesh: Mesh, stays: Flags, views: Sequence[View]) -> list[str]:
    """Return the names of the old photos that still show enough of the old surface.

    Parameters
    ----------
    mesh : the old mesh; stays : (F,) bool; views : the old photos.
    """
    from walltopo.geometry.zbuffer import render_ids

    kept = []
    for view in views:
        camera = view.camera.scaled(min(1.0, _SIDE / max(view.camera.width, view.camera.height)))
        shown, _ = render_ids(mesh.vertices, mesh.faces, camera, view.cam_from_world)
        drawn = shown[shown >= 0]
        if len(drawn) and stays[drawn].mean() >= MIN_SHARE:
            kept.append(view.name)
    return kept


def without_points(model: pycolmap.Reconstruction, mesh: Mesh, stays: Flags) -> None:
    """Delete the points of a model whose nearest triangle is replaced."""
    from scipy.spatial import cKDTree

    numbers = sorted(model.points3D)
    if not numbers or stays.all():
        return
    points = np.array([model.points3D[number].xyz for number in numbers])
    _, nearest = cKDTree(mesh.centroids).query(points, workers=2)
    for number, keep in zip(numbers, stays[nearest].tolist(), strict=True):
        if not keep:
            model.delete_point3D(number)


def join_models(
    old: pycolmap.Reconstruction,
    new: pycolmap.Reconstruction,
    old_names: Sequence[str],
    new_names: Mapping[str, str],
) -> pycolmap.Reconstruction:
    """Return one model of some old photos and of all new ones; poses and intrinsics are copied.

    Parameters
    ----------
    old, new : models in one frame.
    old_names : the old photos to keep; new_names : new photo to its name in the joined model.
    """
    wanted = {name: name for name in old_names}
    first = _rename_images(old, wanted, 1, 1)
    second = _rename_images(new, new_names, 1 + len(wanted), 1 + len(first.cameras))
    _add_model(first, second)
    return first


def _rename_images(
    model: pycolmap.Reconstruction, names: Mapping[str, str], first_image: int, first_camera: int
) -> pycolmap.Reconstruction:
    """Return the named images of a model with new names and consecutive ids."""
    images = [image for image in model.images.values() if image.has_pose and image.name in names]
    images.sort(key=lambda image: image.name)
    used = sorted({image.camera_id for image in images})
    cameras = {old: first_camera + k for k, old in enumerate(used)}
    kept = []
    for number, image in enumerate(images, start=first_image):
        keypoints = np.array([point.xy for point in image.points2D]).reshape(-1, 2)
        index = np.arange(len(keypoints))
        name, camera = names[image.name], cameras[image.camera_id]
        kept.append(KeptImage(image, number, name, camera, keypoints, index))
    return rebuild(model, kept, cameras)


def _add_model(target: pycolmap.Reconstruction, source: pycolmap.Reconstruction) -> None:
    """Add cameras, images and points of a model whose ids the target does not use."""
    from walltopo.geometry.colmap import pycolmap

    for camera in source.cameras.values():
        target.add_camera_with_trivial_rig(pycolmap.Camera(camera.todict()))
    for image in source.images.values():
        copy_image(target, image)
    for point in source.points3D.values():
        elements = [pycolmap.TrackElement(e.image_id, e.point2D_idx) for e in point.track.elements]
        target.add_point3D(point.xyz, pycolmap.Track(elements), point.color)
    target.update_point_3d_errors()

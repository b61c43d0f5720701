"""Projection of a labelled mesh into labelled photos, with occlusion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask, Mesh, Progress, Silent, View
from walltopo.core.files import join_inside
from walltopo_lab.datasets.model import Annotation, Dataset, Photo


def masks_of_view(
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    labels: Mapping[int, int],
    view: View,
    min_pixels: int = 20,
) -> list[tuple[int, Mask]]:
    """Return the visible mask of each instance in one camera, with occlusion and lens distortion.

    Parameters
    ----------
    min_pixels : smaller masks are left out.

    Returns
    -------
    (instance id, mask) in the order of ids; masks of the camera's size.
    """
    from scipy.ndimage import find_objects

    from walltopo.geometry.zbuffer import render_ids

    face_id, _ = render_ids(mesh.vertices, mesh.faces, view.camera, view.cam_from_world)
    seen = np.where(face_id >= 0, face_instance[np.maximum(face_id, 0)], 0)
    height, width = seen.shape
    result: list[tuple[int, Mask]] = []
    for number, window in enumerate(find_objects(seen), start=1):
        if window is None or number not in labels:
            continue
        bitmap = seen[window] == number
        if int(bitmap.sum()) >= min_pixels:
            y, x = window[0].start, window[1].start
            result.append((number, Mask(bitmap, x, y, width, height, labels[number], 1.0)))
    return result


def project_labels(
    mesh: Mesh,
    face_instance: NDArray[np.int32],
    labels: Mapping[int, int],
    classes: Mapping[int, str],
    views: Sequence[View],
    photos: Path | None = None,
    min_pixels: int = 20,
    progress: Progress | None = None,
) -> Dataset:
    """Return a labelled set of all views of a labelled mesh.

    Parameters
    ----------
    face_instance : (F,) int32, 0 = none.
    labels : class id of each instance.
    photos : folder of the photos that the cameras belong to.

    Returns
    -------
    One annotation per instance and photo, with `instance` in its `extra`.
    """
    listener = progress or Silent()
    listener.step("projecting", len(views))
    result: list[Photo] = []
    for view in views:
        rows = tuple(
            Annotation(
                mask.label,
                (float(mask.x), float(mask.y), float(mask.box[2]), float(mask.box[3])),
                mask=mask,
                extra={"instance": number},
            )
            for number, mask in masks_of_view(mesh, face_instance, labels, view, min_pixels)
        )
        picture = join_inside(photos, view.name) if photos else None
        found = picture if picture is not None and picture.is_file() else None
        result.append(Photo(view.name, view.camera.width, view.camera.height, rows, found))
        listener.advance()
    return Dataset(tuple(result), classes)

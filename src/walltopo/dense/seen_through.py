"""Where photos look through: what spans a hole there would stand in front of what they show."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.dense.scene import Scene
from walltopo.raycast import render_ids

__all__ = ["share_seen_through"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Photos are looked at in this size: a hole worth spanning has many pixels still.
_LONGER_SIDE = 640
# A sparse point seen behind a span counts as much as this many pixels: its place is certain.
_POINT = 25


def share_seen_through(
    measured: Mesh, spans: Mesh, span: Ints, scene: Scene, tolerance: Floats
) -> Floats:
    """Of each span, how much of what photos see of it they look through.

    A photo looks through a span where it shows something behind it: the measured surface, or a
    sparse point that it observes.

    Parameters
    ----------
    measured : the mesh with its holes.
    spans : all spans as one mesh, same frame; span : (F,) number of each of its faces.
    tolerance : (number of spans,) what lies less than this behind a span lies on it, world units.

    Returns
    -------
    (number of spans,) share of the pixels, over all photos; 0 where none sees the span.
    """
    count = len(tolerance)
    seen, through = np.zeros(count), np.zeros(count)
    for k, view in enumerate(scene.views):
        factor = min(1.0, _LONGER_SIDE / max(view.camera.width, view.camera.height))
        camera = view.camera.scaled(factor)
        pose = view.cam_from_world
        face, front = render_ids(spans.vertices, spans.faces, camera, pose)
        if not (face >= 0).any():
            continue
        _, behind = render_ids(measured.vertices, measured.faces, camera, pose)
        slack = np.where(face >= 0, tolerance[span[face]], 0.0)
        here = (face >= 0) & (behind > front - slack)
        number = span[face[here]]
        seen += np.bincount(number, minlength=count)
        # The least depth around: a pixel on the hole's own border says nothing.
        nearest = np.asarray(cv2.erode(behind, np.ones((3, 3), np.uint8)))[here]
        far = np.isfinite(nearest) & (nearest > (front + slack)[here])
        through += np.bincount(number[far], minlength=count)
        points = view.to_camera(scene.points[scene.seen[k]])
        pixel = np.nan_to_num(camera.project(points), nan=-1.0)
        x, y = pixel.T.astype(np.int64)
        inside = (pixel >= 0).all(axis=1) & (x < camera.width) & (y < camera.height)
        x, y, z = x[inside], y[inside], points[inside, 2]
        hit = here[y, x] & (z > (front + slack)[y, x])
        through += _POINT * np.bincount(span[face[y[hit], x[hit]]], minlength=count)
    return np.asarray(np.minimum(through / np.maximum(seen, 1.0), 1.0))

"""Where photos look through: what spans a hole there would stand in front of what they show."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh, View
from walltopo.dense.scene import Scene
from walltopo.raycast import Bvh

__all__ = ["share_seen_through"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

# Each span is looked at in about this many of its faces.
_SAMPLES = 64


def share_seen_through(
    measured: Mesh, spans: Mesh, span: Ints, scene: Scene, tolerance: Floats
) -> Floats:
    """Of each span, how much of what photos see of it they look through.

    A photo looks through a span where it shows something behind it: the measured surface, or a
    sparse point that it observes.

    Parameters
    ----------
    measured : the mesh with its holes.
    spans : all spans as one mesh, same frame; span : (F,) number of each of its faces, ascending.
    tolerance : (number of spans,) what lies less than this behind a span lies on it, world units.

    Returns
    -------
    (number of spans,) share of the sight lines, over all photos; 0 where none sees the span.
    """
    count = len(tolerance)
    seen, through = np.zeros(count), np.zeros(count)
    if count == 0:
        return seen
    sample = _sample(span, count)
    surface, closed = Bvh(measured.vertices, measured.faces), Bvh(spans.vertices, spans.faces)
    for k, view in enumerate(scene.views):
        targets, number = spans.centroids[sample], span[sample]
        framed = _framed(view, targets)
        targets, number = targets[framed], number[framed]
        if len(targets) == 0:
            continue
        behind = _beyond(surface, view.centre, targets)
        here = behind > -tolerance[number]
        far = np.isfinite(behind) & (behind > tolerance[number])
        seen += np.bincount(number[here], minlength=count)
        through += np.bincount(number[far], minlength=count)
        points = scene.points[scene.seen[k]]
        rays = points - view.centre
        face, t = closed.first_hit(np.broadcast_to(view.centre, rays.shape), rays)
        hit = np.flatnonzero(face >= 0)
        number = span[face[hit]]
        before = (1.0 - t[hit]) * np.linalg.norm(rays[hit], axis=1) > tolerance[number]
        through += np.bincount(number[before], minlength=count)
    return np.asarray(np.minimum(through / np.maximum(seen, 1.0), 1.0))


def _sample(span: Ints, count: int) -> Ints:
    """Faces of every span, evenly over its order, at most twice `_SAMPLES` of each."""
    size = np.bincount(span, minlength=count)
    first = np.concatenate([[0], np.cumsum(size)])[:-1]
    step = np.maximum(size // _SAMPLES, 1)
    rank = np.arange(len(span)) - first[span]
    return np.flatnonzero(rank % step[span] == 0)


def _framed(view: View, points: Floats) -> NDArray[np.bool_]:
    """(n,) whether points lie in a photo."""
    pixels = np.nan_to_num(view.project(points), nan=-1.0)
    size = (view.camera.width, view.camera.height)
    return np.asarray(((pixels >= 0) & (pixels < size)).all(axis=1))


def _beyond(surface: Bvh, centre: Floats, targets: Floats) -> Floats:
    """(n,) how far behind each target the line of sight meets the surface; inf where it does not,
    negative where it meets it before."""
    rays = targets - centre
    _, t = surface.first_hit(np.broadcast_to(centre, rays.shape), rays)
    return np.asarray((t - 1.0) * np.linalg.norm(rays, axis=1))

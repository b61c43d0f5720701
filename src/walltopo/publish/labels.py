"""Encode the labels of the mesh's triangles for the page, whose tiers contain only patches."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import faces_touching
from walltopo.scans.page_labels import LabelledPlaces, SurfaceLabels

Ints = NDArray[np.int64]
Labels = NDArray[np.int32]

STEPS = 16  # grid steps per median edge, to which centroids are rounded


def surface_labels(mesh: Mesh, patches: Labels, labels: Labels) -> SurfaceLabels:
    """Return the rules by which the label of each triangle follows from its patch.

    Parameters
    ----------
    patches : (F,) as in the tiers; labels : (F,) the holds shown, 0 = wall.
    """
    shown_as = _labels_of_patches(patches, labels)
    changed = np.flatnonzero(shown_as[patches] != labels)
    numbers = np.unique(patches)
    renamed = [(int(p), int(shown_as[p])) for p in numbers if shown_as[p] != p]
    if len(changed) == 0:
        return SurfaceLabels(tuple(renamed), (), (), (0.0, 0.0, 0.0), 1.0, 1.0)
    corners = mesh.vertices[mesh.faces[changed]]
    lengths = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2)
    edge = max(float(np.median(lengths)), 1e-6)
    origin = mesh.centroids[changed].min(axis=0)
    step = edge / STEPS

    def coded(rows: Ints) -> tuple[int, ...]:
        grid = np.rint((mesh.centroids[rows] - origin) / step).astype(np.int64)
        return tuple(np.diff(grid, axis=0, prepend=0).ravel().tolist())

    now = labels[changed]
    x, y, z = origin.tolist()
    return SurfaceLabels(
        patches=tuple(renamed),
        changed=tuple(
            LabelledPlaces(int(label), coded(changed[now == label])) for label in np.unique(now)
        ),
        unchanged=coded(_faces_around(mesh, changed)),
        origin=(x, y, z),
        step=step,
        edge=edge,
    )


def _labels_of_patches(patches: Labels, labels: Labels) -> Labels:
    """Return the most frequent label of each patch, by patch; the wall stays the wall."""
    sizes = np.bincount(patches)
    shown_as = np.arange(len(sizes), dtype=np.int32)
    moved = np.flatnonzero((patches != labels) & (patches > 0))
    for patch in np.unique(patches[moved]):
        values, counts = np.unique(labels[moved[patches[moved] == patch]], return_counts=True)
        if counts.max() > sizes[patch] - counts.sum():
            shown_as[patch] = values[counts.argmax()]
    return shown_as


def _faces_around(mesh: Mesh, rows: Ints) -> Ints:
    """Return the triangles that share a vertex with the given ones, without these."""
    beside = faces_touching(mesh, rows)
    beside[rows] = False
    return np.flatnonzero(beside)

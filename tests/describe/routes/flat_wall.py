"""A wall to put holds on, and the scale of a scan in metres."""

from __future__ import annotations

import numpy as np

from walltopo.core import Mesh
from walltopo.scans.scale import Scale

METRES = Scale(method="measure", scale=1.0, metric=True, up_known=True, floor_known=True)


def wall(width: float = 8.0, height: float = 4.0) -> Mesh:
    """A flat wall in the xz plane with its outside towards -y."""
    x, z = np.meshgrid(np.linspace(0, width, 41), np.linspace(0, height, 21))
    vertices = np.column_stack([x.ravel(), np.zeros(x.size), z.ravel()])
    a = (np.arange(20)[:, None] * 41 + np.arange(40)).ravel()
    faces = np.vstack([np.column_stack([a, a + 1, a + 42]), np.column_stack([a, a + 42, a + 41])])
    return Mesh(vertices, faces)

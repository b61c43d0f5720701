"""Position, normal, size, area and wall angle of an instance, from its triangles alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh

__all__ = ["Shape", "measure_shapes"]

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Shape:
    """Geometry of one instance, world frame, metres.

    Parameters
    ----------
    position : (3,) centroid of its surface, weighted by area.
    normal : (3,) unit, of the wall it sits on, out of the wall.
    size_m : longest extent in the plane of the wall (robust: 1st to 99th percentile).
    width_m : extent across that, in the plane of the wall.
    protrusion_m : how far it stands out of the wall it sits on (99th percentile).
    incut : share of its surface that faces back to the wall or steeply up out of it, 0 to 1.
    area_m2 : area of its triangles.
    steepness_deg : angle of the wall under it: 0 vertical, > 0 overhanging, < 0 slab.
    """

    position: Floats
    normal: Floats
    size_m: float
    width_m: float
    protrusion_m: float
    incut: float
    area_m2: float
    steepness_deg: float


def _spread(values: Floats) -> float:
    low, high = np.percentile(values, [1, 99])
    return float(high - low)


def _plane_axes(normal: Floats) -> Floats:
    """(2, 3) unit vectors across a normal: to the right and up, seen from in front."""
    up = np.array([0.0, 0.0, 1.0]) if abs(normal[2]) < 0.99 else np.array([0.0, 1.0, 0.0])
    right = np.cross(up, normal)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(normal, right)])


def _longest(flat: Floats) -> tuple[float, float]:
    """Longest extent over directions 7.5 degrees apart, and the extent across it."""
    angles = np.arange(24) * np.pi / 24
    directions = np.stack([np.cos(angles), np.sin(angles)])
    extents = np.array([_spread(column) for column in (flat @ directions).T])
    best = int(extents.argmax())
    return float(extents[best]), float(extents[(best + 12) % 24])


def _shape(mesh: Mesh, rows: Ints) -> Shape:
    areas, centroids, normals = mesh.areas[rows], mesh.centroids[rows], mesh.normals[rows]
    total = float(areas.sum())
    weights = areas / total if total > 0 else np.full(len(rows), 1 / len(rows))
    position = weights @ centroids
    # The summed area vectors of a patch depend on its rim only, not on its shape: they are
    # the normal of the wall that the hold sits on, whatever the hold looks like.
    normal = weights @ normals
    length = float(np.linalg.norm(normal))
    normal = normal / length if length > 1e-9 else np.array([0.0, -1.0, 0.0])
    corners = mesh.vertices[mesh.faces[rows].ravel()] - position
    size, width = _longest(corners @ _plane_axes(normal).T)
    facing = normals @ normal
    return Shape(
        position=position,
        normal=normal,
        size_m=size,
        width_m=width,
        protrusion_m=_spread(corners @ normal),
        incut=float(weights[facing < -0.1].sum()),
        area_m2=total,
        steepness_deg=float(np.degrees(np.arcsin(np.clip(-normal[2], -1, 1)))),
    )


def measure_shapes(
    mesh: Mesh, face_instance: NDArray[np.int32], ids: list[int]
) -> dict[int, Shape]:
    """The shape of each instance that has triangles; ids without are left out."""
    order = np.argsort(face_instance, kind="stable")
    labels = face_instance[order]
    shapes: dict[int, Shape] = {}
    for number in ids:
        first, last = np.searchsorted(labels, [number, number + 1])
        if last > first:
            shapes[number] = _shape(mesh, order[first:last])
    return shapes

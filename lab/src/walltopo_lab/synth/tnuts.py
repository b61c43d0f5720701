"""The possible positions of holds: the T-nuts of wall panels and volumes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo_lab.synth.bodies import Facet

Floats = NDArray[np.float64]
# Spacing of T-nuts, metres: (along u, along v); every second row is shifted by half.
SPACING = {"wall": (0.19, 0.165), "fin": (0.19, 0.165), "volume": (0.13, 0.12)}


@dataclass(frozen=True, eq=False)
class Sockets:
    """The T-nuts of all facets.

    Parameters
    ----------
    points : (N, 3) float64 world, metres.
    normals : (N, 3) float64, outward.
    facet : (N,) int32, index of the facet.
    margin : (N,) float64, distance to the facet's nearest edge, metres.
    """

    points: Floats
    normals: Floats
    facet: NDArray[np.int32]
    margin: Floats


def facet_tnuts(facet: Facet) -> Floats:
    """Return the T-nuts of a facet, (N, 2) metres in its chart; none if it takes no holds."""
    if facet.kind not in SPACING:
        return np.zeros((0, 2))
    du, dv = SPACING[facet.kind]
    uv = facet.chart(facet.corners)
    low, high = uv.min(axis=0), uv.max(axis=0)
    rows = np.arange(low[1] + 0.4 * dv, high[1], dv)
    points = [
        (u, v)
        for k, v in enumerate(rows)
        for u in np.arange(low[0] + du * (0.35 + 0.5 * (k % 2)), high[0], du)
    ]
    if not points:
        return np.zeros((0, 2))
    grid = np.array(points)
    return grid[_margins(uv, grid) > 0.03]


def _margins(polygon: Floats, points: Floats) -> Floats:
    edges = np.roll(polygon, -1, axis=0) - polygon
    relative = points[:, None] - polygon[None]
    cross = edges[None, :, 0] * relative[..., 1] - edges[None, :, 1] * relative[..., 0]
    return np.asarray((cross / np.linalg.norm(edges, axis=1)).min(axis=1))


def behind_fins(fins: Sequence[Facet], points: Floats, gap: float) -> NDArray[np.bool_]:
    """Return (N,) True at points that a fin covers, or that lie within `gap` metres of one.

    A fin is a pair of facets that meet in an arete.
    """
    hidden = np.zeros(len(points), np.bool_)
    for left, right in zip(fins[::2], fins[1::2], strict=True):
        inside = points[:, 2] < left.corners[2, 2] + gap
        for facet in (left, right):
            inside &= (points - facet.corners[0]) @ facet.frame[2] < gap
        hidden |= inside
    return hidden


def sockets_of(facets: Sequence[Facet]) -> Sockets:
    """Return all T-nuts of walls, fins and volumes, without those that a fin hides."""
    fins = [facet for facet in facets if facet.kind == "fin"]
    points, normals, index, margins = [], [], [], []
    for number, facet in enumerate(facets):
        uv = facet_tnuts(facet)
        if len(uv) == 0:
            continue
        u, v, n = facet.frame
        world = facet.corners[0] + uv[:, :1] * u + uv[:, 1:] * v
        if facet.kind != "fin":
            free = ~behind_fins(fins, world, 0.06)
            uv, world = uv[free], world[free]
        points.append(world)
        normals.append(np.tile(n, (len(uv), 1)))
        index.append(np.full(len(uv), number, np.int32))
        margins.append(_margins(facet.chart(facet.corners), uv))
    return Sockets(
        np.concatenate(points),
        np.concatenate(normals),
        np.concatenate(index),
        np.concatenate(margins),
    )

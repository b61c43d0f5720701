"""Cut a mesh into charts: connected components that one direction sees well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.geometry.topology import patches
from walltopo.publish.atlas.visible_faces import Axes, axes_towards, render_parallel

Floats = NDArray[np.float64]
MAX_DIRECTIONS = 10
MIN_COSINE = np.cos(np.radians(40.0))  # a direction within this angle sees a triangle well
SMOOTH = 0.3  # cost of a neighbour in another chart, in cosines
SWEEPS = 12
ROUNDS = 3  # of smoothing normals, and of absorbing small charts
MIN_CHART = 40  # a smaller chart (in triangles) is not worth its seams
VIEW_PX = 1200  # longer side of the pictures that decide which faces a direction sees
UP = np.array([0.0, 0.0, 1.0])


def choose_directions(normals: Floats, areas: Floats) -> list[Axes]:
    """Return a few directions that face most of the surface: spherical k-means, farthest first.

    Parameters
    ----------
    normals : (T, 3) unit.
    areas : (T,).
    """
    centres = [_mean(normals, areas)]
    while len(centres) < MAX_DIRECTIONS:
        best = (normals @ np.array(centres).T).max(axis=1)
        poor = best < MIN_COSINE
        if (areas * poor).sum() < 0.02 * areas.sum():
            break
        # The next direction is the mean normal of the faces near the worst-seen triangle.
        seed = normals[np.argmin(np.where(poor, best - 0.01 * areas / areas.max(), np.inf))]
        centres.append(_mean(normals, areas * poor * (normals @ seed > 0.5)))
    for _ in range(4):
        nearest = (normals @ np.array(centres).T).argmax(axis=1)
        centres = [
            _mean(normals, areas * (nearest == k)) if (nearest == k).any() else centre
            for k, centre in enumerate(centres)
        ]
    return [axes_towards(-centre, UP) for centre in centres]


def _mean(normals: Floats, weights: Floats) -> Floats:
    total = (normals * weights[:, None]).sum(axis=0)
    length = float(np.linalg.norm(total))
    return total / length if length > 1e-12 else np.array([0.0, -1.0, 0.0])


def _view_costs(mesh: Mesh, normals: Floats, axes: Sequence[Axes]) -> NDArray[np.float32]:
    """Return the (F, K) cost of viewing each face along each direction: slant and occlusion."""
    centres = mesh.centroids
    cost = np.empty((len(mesh.faces), len(axes)), dtype=np.float32)
    for k, view in enumerate(axes):
        flat = view.flat(mesh.vertices)
        low, extent = flat.min(axis=0), np.ptp(flat, axis=0)
        scale = VIEW_PX / max(float(extent.max()), 1e-9)
        width, height = (int(v) + 1 for v in np.ceil(extent * scale))
        face = render_parallel(mesh.vertices, mesh.faces, view, low, scale, (width, height))
        depth = np.append((mesh.vertices @ view.towards)[mesh.faces].mean(axis=1), np.inf)
        column, row = ((view.flat(centres) - low) * scale).astype(int).T
        front = depth[face[np.clip(row, 0, height - 1), np.clip(column, 0, width - 1)]]
        hidden = centres @ view.towards > front + 4.0 / scale
        cosine = -(normals @ view.towards)
        cost[:, k] = np.where(cosine > 0.05, 1 - cosine, 3.0) + 2.0 * hidden
    return cost


def label_triangles(
    mesh: Mesh, axes: Sequence[Axes], neighbours: NDArray[np.int32]
) -> NDArray[np.int64]:
    """Return the (F,) direction of each face; neighbours agree if that costs little.

    The method is iterated conditional modes on a Potts model. Each sweep updates half of the
    triangles, so that two neighbours do not swap endlessly.
    """
    both = np.argwhere(neighbours >= 0)
    both[:, 1] = neighbours[both[:, 0], both[:, 1]]
    cost = _view_costs(mesh, _smooth_normals(mesh.normals, both), axes)
    label = cost.argmin(axis=1)
    odd = (np.arange(len(label)) * 2654435761 >> 7) % 2
    halves = [np.flatnonzero(odd == turn) for turn in (0, 1)]
    still = 0
    for sweep in range(SWEEPS):
        turn = halves[sweep % 2]
        better = _best_directions(cost, label, neighbours, turn)
        still = still + 1 if (better == label[turn]).all() else 0
        label[turn] = better
        if still == len(halves):
            break
    for _ in range(ROUNDS):
        label = _absorb_small_charts(label, neighbours, both)
    return label


def _best_directions(
    cost: NDArray[np.float32],
    label: NDArray[np.int64],
    neighbours: NDArray[np.int32],
    turn: NDArray[np.int64],
) -> NDArray[np.int64]:
    """Return the (n,) best direction of some faces, with all other faces unchanged."""
    agree = np.zeros((len(turn), cost.shape[1]), dtype=np.float32)
    for corner in range(3):
        beside = neighbours[turn, corner]
        there = np.flatnonzero(beside >= 0)
        agree[there, label[beside[there]]] += np.float32(SMOOTH)
    return np.asarray((cost[turn] - agree).argmin(axis=1))


def _smooth_normals(normals: Floats, both: NDArray[np.int64]) -> Floats:
    """Return normals averaged over neighbours, so that charts follow the surface, not noise."""
    for _ in range(ROUNDS):
        total = normals.copy()
        for axis in range(3):
            total[:, axis] += np.bincount(
                both[:, 0], normals[both[:, 1], axis], minlength=len(normals)
            )
        length = np.linalg.norm(total, axis=1, keepdims=True)
        normals = np.where(length > 1e-9, total / np.maximum(length, 1e-9), normals)
    return normals


def _absorb_small_charts(
    label: NDArray[np.int64], neighbours: NDArray[np.int32], both: NDArray[np.int64]
) -> NDArray[np.int64]:
    """Give small charts the direction of the neighbour with which they share most edges."""
    chart, _ = patches(neighbours, label)
    small = np.bincount(chart)[chart] < MIN_CHART
    border = both[small[both[:, 0]] & (label[both[:, 0]] != label[both[:, 1]])]
    votes = np.zeros((int(chart.max()) + 1, MAX_DIRECTIONS), dtype=np.int32)
    np.add.at(votes, (chart[border[:, 0]], label[border[:, 1]]), 1)
    winner = votes.argmax(axis=1)[chart]
    return np.where(small & (votes.max(axis=1)[chart] > 0), winner, label)

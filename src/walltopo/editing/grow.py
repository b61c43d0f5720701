"""Grow a hold from a place to the edge of relief and colour, without a network.

Each triangle around the place is scored: how similar it is to the place and how different from the
wall, by its colour in the photos and its height over the wall. A minimum cut between the place and
the wall around it then finds the border. The cut is cheap where the surface bends inwards (a hold
meets the wall) or the colour changes, and expensive across smooth surface of one colour.

Source: Y. Boykov, M.-P. Jolly, "Interactive Graph Cuts for Optimal Boundary & Region Segmentation",
2001. We use its two terms with other measurements.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.editing.messages import MissingError
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.view_crops import ViewCrop
from walltopo.geometry.topology import face_neighbours, patches
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEED = 0.015  # metres: triangles this near to the place belong to the hold
# Shares of the maximum radius. The smallest circle that the grown region does not touch is taken,
# because the nearest wall is the best sample of the wall.
SHARES = (0.3, 0.45, 0.65, 1.0)
HELD = 0.05  # maximum share of the border at the circle; with more the circle is too small
MIN_MEAN_SCORE = 0.25  # of the grown region; with less the circle is too small to contain any wall
RIM = 0.85  # share of the radius beyond which triangles count as wall
# Set by hand, not fitted: half of the difference between a hold and a wall in relief and in colour.
HEIGHT = 0.006  # metres over the wall that count as much as `COLOUR`
COLOUR = 0.06  # OKLab distance that counts as much as `HEIGHT`
BEND_DEG = 25.0  # an inward bend of this angle is a border
SMOOTH = 1.0  # weight of the border against the scores
ROUNDS = 3
SCALE = 1000  # factor for the cut's capacities, which are integers


@dataclass(frozen=True, eq=False)
class WallPlane:
    """The plane of the wall under a place: `normal` (3,) unit, out of the wall; `point` on it."""

    normal: Floats
    point: Floats

    def heights(self, places: Floats) -> Floats:
        """Return the (n,) heights of (n, 3) places over the plane."""
        return np.asarray((places - self.point) @ self.normal)


def wall_around(
    snapshot: ScanSnapshot, labels: NDArray[np.int32], at: Floats, radius: float
) -> WallPlane:
    """Return the plane of the wall around a place, from triangles without a hold.

    The place itself may lie on a hold that the scan missed. Triangles away from the plane of the
    others are therefore dropped, round by round.
    """
    mesh = snapshot.mesh
    rows = snapshot.triangles.within(at, 1.3 * radius)
    rows = rows[labels[rows] == 0]
    if len(rows) < 12:
        raise MissingError("no_wall")
    points, weight = mesh.centroids[rows], mesh.areas[rows]
    keep = np.linalg.norm(points - at, axis=1) > 0.5 * radius
    keep = keep if keep.sum() >= 12 else np.ones(len(rows), dtype=bool)
    normal = weight[keep] @ mesh.normals[rows[keep]]
    normal /= max(float(np.linalg.norm(normal)), 1e-12)
    height = (points - at) @ normal
    base = float(np.percentile(height[keep], 35))
    for limit in (0.03, 0.015, 0.01):
        near = np.abs((points - at) @ normal - base) < limit * snapshot.unit
        if near.sum() < 12:
            break
        total = weight[near] @ mesh.normals[rows[near]]
        normal = total / max(float(np.linalg.norm(total)), 1e-12)
        base = float(np.median((points[near] - at) @ normal))
    return WallPlane(normal, at + base * normal)


def grow(
    snapshot: ScanSnapshot,
    labels: NDArray[np.int32],
    at: Floats,
    radius: float,
    crops: Sequence[ViewCrop],
) -> Ints:
    """Return the (n,) triangles of the hold around a place, without those of other holds.

    Parameters
    ----------
    labels : (F,) int32, 0 = wall.
    at : (3,) world frame; radius : maximum distance of a triangle, world units.
    crops : the place in photos; without crops, relief alone decides.

    Raises
    ------
    MissingError : no free surface or no wall is around the place.
    """
    found: Ints | None = None
    for share in SHARES:
        found, held = _grown_within(snapshot, labels, at, share * radius, crops)
        if not held:
            break
    assert found is not None
    return found


def _grown_within(
    snapshot: ScanSnapshot,
    labels: NDArray[np.int32],
    at: Floats,
    radius: float,
    crops: Sequence[ViewCrop],
) -> tuple[Ints, bool]:
    """Return the region that grows within a radius, and whether the radius is too small."""
    mesh, unit = snapshot.mesh, snapshot.unit
    rows = snapshot.triangles.within(at, radius)
    rows = rows[labels[rows] == 0]
    if len(rows) == 0:
        raise MissingError("no_surface")
    away = np.linalg.norm(mesh.centroids[rows] - at, axis=1)
    beside = face_neighbours(mesh.faces[rows])
    part, _ = patches(beside, np.zeros(len(rows), dtype=np.int32))
    own = part == part[away.argmin()]
    rows, away = rows[own], away[own]
    beside = face_neighbours(mesh.faces[rows])
    wall = wall_around(snapshot, labels, at, radius)
    seed = away <= max(SEED * unit, float(away.min()))
    rim = away >= RIM * radius
    score = _hold_scores(snapshot, rows, seed, rim, wall, crops)
    scores = score.copy()
    score[seed], score[rim & ~seed] = np.inf, -np.inf
    chosen = _minimum_cut(score, *_border_costs(snapshot, rows, beside, wall, crops))
    part, _ = patches(beside, chosen.astype(np.int32))
    found = _without_holes(beside, chosen & (part == part[away.argmin()]))
    others = beside[found]
    border = others[(others >= 0) & ~found[np.maximum(others, 0)]]
    held = len(border) == 0 or float(rim[border].mean()) > HELD
    # If nothing differs from the presumed wall, the circle lies inside the hold.
    blind = float(scores[found & ~seed].mean()) < MIN_MEAN_SCORE if (found & ~seed).any() else True
    return rows[found], held or blind


def _hold_scores(
    snapshot: ScanSnapshot,
    rows: Ints,
    seed: NDArray[np.bool_],
    rim: NDArray[np.bool_],
    wall: WallPlane,
    crops: Sequence[ViewCrop],
) -> Floats:
    """Return (n,) scores, > 0 for the hold, < 0 for the wall: colour plus height, each in +-1."""
    heights = wall.heights(snapshot.mesh.centroids[rows]) / snapshot.unit
    score = np.clip((heights - HEIGHT) / HEIGHT, -1.0, 1.0)
    colours = face_colours(snapshot, rows, crops)
    known = np.isfinite(colours[:, 0])
    if not (known & seed).any() or not (known & ~seed).any():
        return np.asarray(score)
    hold = np.median(colours[known & seed], axis=0)
    ground = known & (rim | (heights < HEIGHT)) & ~seed
    if not ground.any():
        return np.asarray(score)
    for _ in range(ROUNDS):
        plain = np.median(colours[ground], axis=0)
        apart = float(np.linalg.norm(hold - plain))
        like = np.linalg.norm(colours - plain, axis=1) - np.linalg.norm(colours - hold, axis=1)
        tint = np.where(known, np.clip(like / COLOUR, -1.0, 1.0), 0.0)
        # Colour has little weight if hold and wall have similar colours.
        both = score + min(apart / COLOUR, 1.0) * tint
        grown = known & (both > 0.3)
        if grown.any():
            hold = np.median(colours[grown], axis=0)
        ground = known & (both < -0.3) if (known & (both < -0.3)).any() else ground
    return np.asarray(both)


def face_colours(snapshot: ScanSnapshot, rows: Ints, crops: Sequence[ViewCrop]) -> Floats:
    """Return (n, 3) OKLab of triangles under one light; NaN if no photo shows the triangle."""
    index = np.full(len(snapshot.mesh.faces) + 1, -1, dtype=np.int64)
    index[rows] = np.arange(len(rows))
    per_photo: list[Floats] = []
    for crop in crops:
        own = index[crop.face.ravel()]  # -1 indexes the last entry, which stays -1
        there = own >= 0
        linear = linear_from_srgb8(crop.picture.reshape(-1, 3)[there])
        linear = linear * np.exp(-snapshot.light.gain[crop.photo])
        count = np.bincount(own[there], minlength=len(rows))
        total = np.stack(
            [np.bincount(own[there], linear[:, k], len(rows)) for k in range(3)], axis=1
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            per_photo.append(total / count[:, None])
    if not per_photo:
        return np.full((len(rows), 3), np.nan)
    with np.errstate(all="ignore"):
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # all-NaN: no photo shows the triangle
            linear = np.nanmedian(np.stack(per_photo), axis=0)
    known = np.isfinite(linear[:, 0])
    found = np.full((len(rows), 3), np.nan)
    found[known] = oklab_from_linear(linear[known])
    return found


def _border_costs(
    snapshot: ScanSnapshot,
    rows: Ints,
    beside: NDArray[np.int32],
    wall: WallPlane,
    crops: Sequence[ViewCrop],
) -> tuple[Ints, Floats]:
    """Return (E, 2) neighbours and (E,) the cost of a border: its length, less at an edge."""
    mesh = snapshot.mesh
    one = np.repeat(np.arange(len(rows)), 3)
    corner = np.tile(np.arange(3), len(rows))
    two = beside.ravel().astype(np.int64)
    inner = (two > one) & (two >= 0)
    one, corner, two = one[inner], corner[inner], two[inner]
    start = mesh.vertices[mesh.faces[rows[one], corner]]
    end = mesh.vertices[mesh.faces[rows[one], (corner + 1) % 3]]
    length = np.linalg.norm(end - start, axis=1)
    length = length / max(float(length.mean()), 1e-12) if len(length) else length
    normals, centres = mesh.normals[rows], mesh.centroids[rows]
    cosine = np.clip((normals[one] * normals[two]).sum(axis=1), -1, 1)
    inwards = ((centres[two] - centres[one]) * normals[one]).sum(axis=1) > 0
    bend = np.where(inwards, np.degrees(np.arccos(cosine)) / BEND_DEG, 0.0)
    colours = face_colours(snapshot, rows, crops)
    step = np.linalg.norm(colours[one] - colours[two], axis=1) / COLOUR
    step = np.where(np.isfinite(step), step, 0.0)
    return np.column_stack([one, two]), SMOOTH * length * np.exp(-(bend**2) - step**2)


def _minimum_cut(score: Floats, pairs: Ints, cost: Floats) -> NDArray[np.bool_]:
    """Return (n,) whether each triangle is on the hold's side of the minimum cut.

    Scores of inf and -inf fix the side.
    """
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = len(score)
    source, sink = count, count + 1
    limit = float(np.abs(score[np.isfinite(score)]).sum() + cost.sum()) + 1.0
    gain = np.clip(score, -limit, limit)
    for_hold, for_wall = np.flatnonzero(gain > 0), np.flatnonzero(gain < 0)
    start = np.concatenate([pairs[:, 0], pairs[:, 1], np.full(len(for_hold), source), for_wall])
    end = np.concatenate([pairs[:, 1], pairs[:, 0], for_hold, np.full(len(for_wall), sink)])
    capacity = np.concatenate([cost, cost, gain[for_hold], -gain[for_wall]])
    whole = np.minimum(np.rint(capacity * SCALE), 2**30).astype(np.int32)
    graph = coo_matrix((whole, (start, end)), (count + 2, count + 2)).tocsr()
    flow = maximum_flow(graph, source, sink).flow
    rest = graph - flow
    rest.data[rest.data < 0] = 0
    rest.eliminate_zeros()
    reached = breadth_first_order(rest, source, return_predecessors=False)
    side = np.zeros(count + 2, dtype=bool)
    side[reached] = True
    return side[:count]


def _without_holes(beside: NDArray[np.int32], found: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the region with its holes filled: only faces connected to the outside stay out."""
    part, _ = patches(beside, found.astype(np.int32))
    outside = ~found
    if not outside.any():
        return found
    sizes = np.bincount(part[outside], minlength=int(part.max()) + 1)
    return np.asarray(found | (outside & (part != int(sizes.argmax()))))

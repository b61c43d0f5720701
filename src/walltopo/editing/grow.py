"""A hold grows from a place to the edge of relief and colour, without a network.

Each triangle around the place is scored: how much it is like the place and unlike the wall, by its
colour in the photos and by how far it stands out of the wall. A minimum cut between the place and
the wall around it then finds the border: cheap where the surface bends inwards (a hold meets the
wall) or the colour changes, dear across smooth surface of one colour.

Source: Y. Boykov, M.-P. Jolly, "Interactive Graph Cuts for Optimal Boundary & Region Segmentation",
2001: the two terms; ours differ in what they measure.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.editing.notes import MissingError
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.editing.view_crops import Look
from walltopo.geometry.neighbours import face_neighbours, patches
from walltopo.images.colour import linear_from_srgb8, oklab_from_linear

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

SEED = 0.015  # metres: triangles so near to the place are of the hold
# Of the bound: the smallest circle that what grows does not lean against is taken, for the wall
# that is nearest tells best what the wall is.
SHARES = (0.3, 0.45, 0.65, 1.0)
HELD = 0.05  # share of a border that leans against the circle, from which on it was too small
LEAST = 0.25  # mean score of what grows; with less the circle was too small to hold any wall
RIM = 0.85  # share of the bound beyond which triangles are of the wall
# Set by hand, not fitted: half of what separates a hold from a wall in relief and in colour.
HEIGHT = 0.006  # metres out of the wall that say as much as `COLOUR`
COLOUR = 0.06  # OKLab distance that says as much as `HEIGHT`
BEND_DEG = 25.0  # an inward bend so sharp is a border
SMOOTH = 1.0  # of the border against the scores
ROUNDS = 3
SCALE = 1000  # the cut's capacities are whole numbers


@dataclass(frozen=True, eq=False)
class Wall:
    """The plane of the wall under a place: `normal` (3,) unit, out of it; a `point` of it."""

    normal: Floats
    point: Floats

    def heights(self, places: Floats) -> Floats:
        """(n,) how far (n, 3) places stand out of it."""
        return np.asarray((places - self.point) @ self.normal)


def wall_around(
    scanned: ScanSnapshot, labels: NDArray[np.int32], at: Floats, radius: float
) -> Wall:
    """The plane of the wall around a place, from triangles that are of no hold.

    The place itself may be on a hold that nobody found: what stands out of the plane of the rest
    is dropped, round by round.
    """
    mesh = scanned.mesh
    rows = scanned.triangles.within(at, 1.3 * radius)
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
        near = np.abs((points - at) @ normal - base) < limit * scanned.unit
        if near.sum() < 12:
            break
        total = weight[near] @ mesh.normals[rows[near]]
        normal = total / max(float(np.linalg.norm(total)), 1e-12)
        base = float(np.median((points[near] - at) @ normal))
    return Wall(normal, at + base * normal)


def grow(
    scanned: ScanSnapshot,
    labels: NDArray[np.int32],
    at: Floats,
    radius: float,
    looks: Sequence[Look],
) -> Ints:
    """(n,) triangles of the hold around a place; those of other holds are never among them.

    Parameters
    ----------
    labels : (F,) int32, 0 = wall.
    at : (3,) world frame; radius : no triangle is farther, world units.
    looks : the place in photos; without any, relief alone decides.

    Raises
    ------
    MissingError : there is no free surface, or nothing that differs from the wall.
    """
    found: Ints | None = None
    for share in SHARES:
        found, held = _grown_within(scanned, labels, at, share * radius, looks)
        if not held:
            break
    assert found is not None
    return found


def _grown_within(
    scanned: ScanSnapshot,
    labels: NDArray[np.int32],
    at: Floats,
    radius: float,
    looks: Sequence[Look],
) -> tuple[Ints, bool]:
    """What grows within a radius, and whether the radius held it back."""
    mesh, unit = scanned.mesh, scanned.unit
    rows = scanned.triangles.within(at, radius)
    rows = rows[labels[rows] == 0]
    if len(rows) == 0:
        raise MissingError("no_surface")
    away = np.linalg.norm(mesh.centroids[rows] - at, axis=1)
    beside = face_neighbours(mesh.faces[rows])
    part, _ = patches(beside, np.zeros(len(rows), dtype=np.int32))
    own = part == part[away.argmin()]
    rows, away = rows[own], away[own]
    beside = face_neighbours(mesh.faces[rows])
    wall = wall_around(scanned, labels, at, radius)
    seed = away <= max(SEED * unit, float(away.min()))
    rim = away >= RIM * radius
    score = _scores(scanned, rows, seed, rim, wall, looks)
    scores = score.copy()
    score[seed], score[rim & ~seed] = np.inf, -np.inf
    chosen = _cut(score, *_borders(scanned, rows, beside, wall, looks))
    part, _ = patches(beside, chosen.astype(np.int32))
    found = _without_holes(beside, chosen & (part == part[away.argmin()]))
    others = beside[found]
    border = others[(others >= 0) & ~found[np.maximum(others, 0)]]
    held = len(border) == 0 or float(rim[border].mean()) > HELD
    # Nothing differs from what was taken for the wall: that was the hold itself.
    blind = float(scores[found & ~seed].mean()) < LEAST if (found & ~seed).any() else True
    return rows[found], held or blind


def _scores(
    scanned: ScanSnapshot,
    rows: Ints,
    seed: NDArray[np.bool_],
    rim: NDArray[np.bool_],
    wall: Wall,
    looks: Sequence[Look],
) -> Floats:
    """(n,) > 0 for the hold, < 0 for the wall: colour and height, each within one."""
    heights = wall.heights(scanned.mesh.centroids[rows]) / scanned.unit
    score = np.clip((heights - HEIGHT) / HEIGHT, -1.0, 1.0)
    colours = face_colours(scanned, rows, looks)
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
        # Where hold and wall are of one colour, it tells nothing.
        both = score + min(apart / COLOUR, 1.0) * tint
        grown = known & (both > 0.3)
        if grown.any():
            hold = np.median(colours[grown], axis=0)
        ground = known & (both < -0.3) if (known & (both < -0.3)).any() else ground
    return np.asarray(both)


def face_colours(scanned: ScanSnapshot, rows: Ints, looks: Sequence[Look]) -> Floats:
    """(n, 3) OKLab of triangles under one light; NaN where no photo shows one."""
    index = np.full(len(scanned.mesh.faces) + 1, -1, dtype=np.int64)
    index[rows] = np.arange(len(rows))
    seen: list[Floats] = []
    for look in looks:
        own = index[look.face.ravel()]  # -1 leads to the last one, which is none
        there = own >= 0
        linear = linear_from_srgb8(look.picture.reshape(-1, 3)[there])
        linear = linear * np.exp(-scanned.light.gain[look.photo])
        count = np.bincount(own[there], minlength=len(rows))
        total = np.stack(
            [np.bincount(own[there], linear[:, k], len(rows)) for k in range(3)], axis=1
        )
        with np.errstate(invalid="ignore", divide="ignore"):
            seen.append(total / count[:, None])
    if not seen:
        return np.full((len(rows), 3), np.nan)
    with np.errstate(all="ignore"):
        import warnings

        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of triangles that none shows
            linear = np.nanmedian(np.stack(seen), axis=0)
    known = np.isfinite(linear[:, 0])
    found = np.full((len(rows), 3), np.nan)
    found[known] = oklab_from_linear(linear[known])
    return found


def _borders(
    scanned: ScanSnapshot,
    rows: Ints,
    beside: NDArray[np.int32],
    wall: Wall,
    looks: Sequence[Look],
) -> tuple[Ints, Floats]:
    """(E, 2) neighbours, and (E,) what a border between them costs: its length, less at an edge."""
    mesh = scanned.mesh
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
    colours = face_colours(scanned, rows, looks)
    step = np.linalg.norm(colours[one] - colours[two], axis=1) / COLOUR
    step = np.where(np.isfinite(step), step, 0.0)
    return np.column_stack([one, two]), SMOOTH * length * np.exp(-(bend**2) - step**2)


def _cut(score: Floats, pairs: Ints, cost: Floats) -> NDArray[np.bool_]:
    """(n,) the side of the hold of the minimum cut; score inf and -inf: decided."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import breadth_first_order, maximum_flow

    count = len(score)
    source, sink = count, count + 1
    most = float(np.abs(score[np.isfinite(score)]).sum() + cost.sum()) + 1.0
    gain = np.clip(score, -most, most)
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
    """With the islands that lie in it: only what hangs together with the outside stays out."""
    part, _ = patches(beside, found.astype(np.int32))
    outside = ~found
    if not outside.any():
        return found
    sizes = np.bincount(part[outside], minlength=int(part.max()) + 1)
    return np.asarray(found | (outside & (part != int(sizes.argmax()))))

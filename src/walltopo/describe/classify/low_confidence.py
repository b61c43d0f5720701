"""Instances that are probably no holds: low scores, or flat against the wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.describe.classify.cutouts import best_views
from walltopo.describe.classify.geometry import Shape, rim_normal, triangles_of
from walltopo.describe.classify.observations import HoldView
from walltopo.describe.classify.settings import ClassifySettings
from walltopo.geometry.similarity import fit_plane
from walltopo.scans.attributes import FLAT, Doubtful, Hold
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.scale import Plate, Scale, unit_of_sizes

# Why an instance is left out: the words of `attributes.json`.
FAINT = "few photos confirm it"

BUMP = "stands out of the wall, but photos hardly show a hold"

PLATED = "lies on a printed plate"

CUTOUTS_OF_DOUBTFUL = 1

# Nearer to a plate than this share of half its height is on it.
PLATE_REACH = 0.5


@dataclass(frozen=True, eq=False)
class Lifted:
    """What the lift found.

    Parameters
    ----------
    face_instance : (F,) int32, instance id of each triangle, 0 = none.
    kinds : instance id to its class, "hold" or "volume".
    scores : instance id to how sure it is, in [0, 1].
    judged : ids whose score is the evidence of masks, relief and colour together; of the others
        it is the lift's.
    unmasked : ids that no mask was lifted to.
    """

    face_instance: NDArray[np.int32]
    kinds: dict[int, str]
    scores: dict[int, float]
    judged: frozenset[int] = frozenset()
    unmasked: frozenset[int] = frozenset()

    @classmethod
    def of(cls, table: InstanceTable, records: InstanceRecords) -> Lifted:
        """From the two files of instances."""
        return cls(
            table.face_instance,
            {record.id: record.kind for record in records.instances},
            {record.id: record.surety for record in records.instances},
            frozenset(r.id for r in records.instances if r.evidence is not None),
            frozenset(r.id for r in records.instances if not r.views),
        )


def doubtful(
    scale: Scale,
    mesh: Mesh,
    lifted: Lifted,
    shapes: Mapping[int, Shape],
    settings: ClassifySettings,
) -> dict[int, str]:
    """Ids of the instances that are no holds, or hardly confirmed, and why.

    Parameters
    ----------
    mesh : the scan's; shapes : of the instances that have triangles.
    """
    kinds = lifted.kinds
    faint = {
        number: BUMP if number in lifted.unmasked else FAINT
        for number, score in lifted.scores.items()
        if score < (settings.least_evidence if number in lifted.judged else settings.least_score)
    }
    sizes = [s.size for n, s in shapes.items() if n not in faint and kinds[n] == "hold"]
    unit = unit_of_sizes(sizes, scale.metric, settings.typical_hold)
    present = {number: kinds[number] for number in shapes}
    rises = measure_rises(mesh, lifted.face_instance, present, unit)
    flat = flat_instances(rises, unit, settings.flat_below)
    plated = on_plates({number: shape.position for number, shape in shapes.items()}, scale.plates)
    return faint | dict.fromkeys(flat, FLAT) | dict.fromkeys(plated, PLATED)


def on_plates(positions: Mapping[int, NDArray[np.float64]], plates: Sequence[Plate]) -> set[int]:
    """Ids of the instances that lie on a printed plate of the measure.

    Parameters
    ----------
    positions : instance id to its (3,) place in the world frame.
    """
    found: set[int] = set()
    for plate in plates:
        corners = np.array(plate.corners, dtype=np.float64).reshape(-1, 3)
        if len(corners) != 4:
            continue
        middle = corners.mean(axis=0)
        right, up = (corners[1] - corners[0]) / 2, (corners[0] - corners[3]) / 2
        out = np.cross(right, up) / np.linalg.norm(right)  # as long as half the sheet is high
        for number, position in positions.items():
            offset = np.asarray(position) - middle
            shares = [abs(offset @ axis) / (axis @ axis) for axis in (right, up)]
            if max(shares) <= 1 and abs(offset @ out) <= PLATE_REACH * (out @ out):
                found.add(number)
    return found


def left_out(
    holds: Sequence[Hold],
    scores: Mapping[int, float],
    doubts: Mapping[int, str],
    seen: Mapping[int, Sequence[HoldView]],
) -> tuple[list[Doubtful], dict[int, list[HoldView]]]:
    """The holds that are in `doubts`, the surest first, and the cutouts to keep of them."""
    ranked = sorted(
        (hold for hold in holds if hold.id in doubts),
        key=lambda hold: (-scores[hold.id], hold.id),
    )
    rows = [Doubtful(hold.rounded(), round(scores[hold.id], 4), doubts[hold.id]) for hold in ranked]
    cutouts = {h.id: best_views(seen.get(h.id, ()), CUTOUTS_OF_DOUBTFUL) for h in ranked}
    return rows, cutouts


Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

RING = 1.8  # radius, in an instance's own radii, in which the wall around it is fitted

LARGEST = 0.5  # metres: radius beyond which nothing is a mark on the wall

LEAST_RING, MOST_RING = 24, 4_000  # triangles of wall that a plane is fitted to

AGREE_DEG = 25.0  # ring triangles turned farther away belong to another panel

ROUNDS = 4  # of fitting the plane without outliers (holds that were not found, edges)

OUTLIER = 3.0  # standard deviations

TOP = 90.0  # percentile of the heights that counts as the top


@dataclass(frozen=True)
class Rise:
    """How an instance stands out of the wall around it, in scan units.

    Parameters
    ----------
    height : 90th percentile of the heights of its vertices over the plane of the wall.
    noise : standard deviation of the centroids of the wall's triangles from that plane, robust.
    """

    height: float
    noise: float


@dataclass(frozen=True, eq=False)
class _Bare:
    """The triangles of no hold: the wall and its volumes."""

    tree: Any
    centroids: Floats
    normals: Floats
    label: NDArray[np.int32]

    @classmethod
    def of(cls, mesh: Mesh, face_instance: NDArray[np.int32], kinds: Mapping[int, str]) -> _Bare:
        from scipy.spatial import cKDTree

        bare = [0, *(number for number, kind in kinds.items() if kind == "volume")]
        rows = np.flatnonzero(np.isin(face_instance, bare))
        centroids = mesh.centroids[rows]
        return cls(cKDTree(centroids), centroids, mesh.normals[rows], face_instance[rows])

    def around(self, number: int, middle: Floats, normal: Floats, radius: float) -> Floats:
        """(n, 3) centroids of the wall around an instance that face as it does."""
        near = np.array(sorted(self.tree.query_ball_point(middle, radius)), dtype=np.int64)
        near = near[:: max(1, len(near) // MOST_RING)]
        agree = self.normals[near] @ normal > np.cos(np.radians(AGREE_DEG))
        return self.centroids[near[agree & (self.label[near] != number)]]


def _plane(points: Floats, normal: Floats) -> tuple[Floats, float]:
    """(4,) plane (unit normal, offset) through most of the points, and their spread around it."""
    plane, spread = np.zeros(4), np.inf
    kept = np.ones(len(points), dtype=np.bool_)
    for _ in range(ROUNDS):
        axis, offset = fit_plane(points[kept])
        plane = np.append(axis, -offset) * (1.0 if axis @ normal > 0 else -1.0)
        away = points @ plane[:3] + plane[3]
        spread = 1.4826 * float(np.median(np.abs(away[kept] - np.median(away[kept]))))
        kept = np.abs(away - np.median(away[kept])) <= OUTLIER * spread + 1e-12
    return plane, spread


def measure_rises(
    mesh: Mesh, face_instance: NDArray[np.int32], kinds: Mapping[int, str], unit: float
) -> dict[int, Rise]:
    """How far the instances stand out of the wall.

    Parameters
    ----------
    mesh : the scan's mesh; face_instance : (F,) int32, 0 = none.
    kinds : instance id to its class, "hold" or "volume".
    unit : scan units a metre.

    Returns
    -------
    By instance id. Left out are those with no triangles, larger than any mark on a wall, or with
    too little wall around them.
    """
    bare = _Bare.of(mesh, face_instance, kinds)
    if len(bare.centroids) == 0:
        return {}
    rises: dict[int, Rise] = {}
    for number, rows in triangles_of(face_instance, sorted(kinds)):
        normal = rim_normal(mesh, rows)
        if normal is None:
            continue
        points = mesh.vertices[np.unique(mesh.faces[rows])]
        middle = np.median(points, axis=0)
        reach = float(np.percentile(np.linalg.norm(points - middle, axis=1), 98))
        if reach > LARGEST * unit:
            continue
        ring = bare.around(number, middle, normal, RING * reach)
        if len(ring) >= LEAST_RING:
            plane, noise = _plane(ring, normal)
            heights = points @ plane[:3] + plane[3]
            rises[number] = Rise(float(np.percentile(heights, TOP)), noise)
    return rises


def flat_instances(rises: Mapping[int, Rise], unit: float, below: float) -> set[int]:
    """Ids of the instances that stand out by less than `below` metres.

    Where the wall around is rougher than half of that, the mesh cannot tell, and nothing is flat.
    """
    return {
        number
        for number, rise in rises.items()
        if rise.height < below * unit and rise.noise < 0.5 * below * unit
    }

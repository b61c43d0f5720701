"""Find instances that are probably no holds: low scores, or flat against the wall."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.core.instances import triangles_of
from walltopo.describe.classify.geometry import Shape, rim_normal
from walltopo.describe.classify.observations import HoldView, best_views
from walltopo.describe.settings import ClassifySettings
from walltopo.geometry.similarity import fit_plane
from walltopo.scans.holds import FLAT, Hold
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.scale import Plate, Scale, unit_of_sizes

# The reasons for low confidence, as `holds.json` has them.
FAINT = "few photos confirm it"

BUMP = "stands out of the wall, but photos hardly show a hold"

PLATED = "lies on a printed plate"

LOW_CONFIDENCE_CUTOUTS = 1

# Maximum distance of an instance on a plate, as a share of half the plate's height.
PLATE_REACH = 0.5


@dataclass(frozen=True, eq=False)
class Lifted:
    """The instances of the lift.

    Parameters
    ----------
    face_instance : (F,) int32, instance id of each triangle, 0 = none.
    kinds : instance id to its class, "hold" or "volume".
    scores : instance id to confidence, in [0, 1].
    judged : ids whose score is the combined evidence of masks, relief and colour. The scores of the
        others come from the lift.
    unmasked : ids to which no mask was lifted.
    """

    face_instance: NDArray[np.int32]
    kinds: dict[int, str]
    scores: dict[int, float]
    judged: frozenset[int] = frozenset()
    unmasked: frozenset[int] = frozenset()

    @classmethod
    def of(cls, table: InstanceTable, records: InstanceRecords) -> Lifted:
        """Build the instances from the two files."""
        return cls(
            table.face_instance,
            {record.id: record.kind for record in records.instances},
            {record.id: record.confidence for record in records.instances},
            frozenset(r.id for r in records.instances if r.evidence is not None),
            frozenset(r.id for r in records.instances if not r.views),
        )


def low_confidence_reasons(
    scale: Scale,
    mesh: Mesh,
    lifted: Lifted,
    shapes: Mapping[int, Shape],
    settings: ClassifySettings,
) -> dict[int, str]:
    """Return the ids of instances that are probably no holds, with the reason.

    Parameters
    ----------
    mesh : the scan's mesh; shapes : of the instances that have triangles.
    """
    kinds = lifted.kinds
    faint = {
        number: BUMP if number in lifted.unmasked else FAINT
        for number, score in lifted.scores.items()
        if score < (settings.min_evidence if number in lifted.judged else settings.min_score)
    }
    sizes = [s.size for n, s in shapes.items() if n not in faint and kinds[n] == "hold"]
    unit = unit_of_sizes(sizes, scale.metric, settings.typical_hold)
    present = {number: kinds[number] for number in shapes}
    rises = measure_rises(mesh, lifted.face_instance, present, unit)
    flat = flat_instances(rises, unit, settings.flat_below)
    plated = on_plates({number: shape.position for number, shape in shapes.items()}, scale.plates)
    return faint | dict.fromkeys(flat, FLAT) | dict.fromkeys(plated, PLATED)


def on_plates(positions: Mapping[int, NDArray[np.float64]], plates: Sequence[Plate]) -> set[int]:
    """Return the ids of the instances that lie on a scale plate.

    Parameters
    ----------
    positions : instance id to (3,) position in the world frame.
    """
    found: set[int] = set()
    for plate in plates:
        corners = np.array(plate.corners, dtype=np.float64).reshape(-1, 3)
        if len(corners) != 4:
            continue
        middle = corners.mean(axis=0)
        right, up = (corners[1] - corners[0]) / 2, (corners[0] - corners[3]) / 2
        out = np.cross(right, up) / np.linalg.norm(right)  # length: half the height of the sheet
        for number, position in positions.items():
            offset = np.asarray(position) - middle
            shares = [abs(offset @ axis) / (axis @ axis) for axis in (right, up)]
            if max(shares) <= 1 and abs(offset @ out) <= PLATE_REACH * (out @ out):
                found.add(number)
    return found


def low_confidence_rows(
    holds: Sequence[Hold],
    reasons: Mapping[int, str],
    views: Mapping[int, Sequence[HoldView]],
) -> tuple[list[Hold], dict[int, list[HoldView]]]:
    """Return the holds in `reasons`, highest score first, and the cutouts to keep of them."""
    ranked = sorted(
        (hold for hold in holds if hold.id in reasons),
        key=lambda hold: (-hold.score, hold.id),
    )
    rows = [replace(hold, left_out=reasons[hold.id]).rounded() for hold in ranked]
    cutouts = {h.id: best_views(views.get(h.id, ()), LOW_CONFIDENCE_CUTOUTS) for h in ranked}
    return rows, cutouts


Floats = NDArray[np.float64]

Ints = NDArray[np.int64]

RING = 1.8  # radius of the ring for the plane of the wall, in radii of the instance

MAX_RADIUS = 0.5  # metres: a larger instance is no mark on the wall

MIN_RING, MAX_RING = 24, 4_000  # number of wall triangles for the plane

AGREE_DEG = 25.0  # a ring triangle at a larger angle belongs to another panel

ROUNDS = 4  # of plane fitting without outliers (missed holds, edges)

OUTLIER = 3.0  # standard deviations

TOP = 90.0  # percentile of the heights that counts as the top


@dataclass(frozen=True)
class Rise:
    """The height of an instance over the wall around it, in scan units.

    Parameters
    ----------
    height : 90th percentile of the heights of its vertices over the plane of the wall.
    noise : robust standard deviation of the wall's triangle centroids from that plane.
    """

    height: float
    noise: float


@dataclass(frozen=True, eq=False)
class _BareWall:
    """The triangles without holds: the wall and its volumes."""

    tree: Any
    centroids: Floats
    normals: Floats
    label: NDArray[np.int32]

    @classmethod
    def of(
        cls, mesh: Mesh, face_instance: NDArray[np.int32], kinds: Mapping[int, str]
    ) -> _BareWall:
        from scipy.spatial import cKDTree

        bare = [0, *(number for number, kind in kinds.items() if kind == "volume")]
        rows = np.flatnonzero(np.isin(face_instance, bare))
        centroids = mesh.centroids[rows]
        return cls(cKDTree(centroids), centroids, mesh.normals[rows], face_instance[rows])

    def around(self, number: int, middle: Floats, normal: Floats, radius: float) -> Floats:
        """Return (n, 3) centroids of the wall around an instance with a similar normal."""
        near = np.array(sorted(self.tree.query_ball_point(middle, radius)), dtype=np.int64)
        near = near[:: max(1, len(near) // MAX_RING)]
        agree = self.normals[near] @ normal > np.cos(np.radians(AGREE_DEG))
        return self.centroids[near[agree & (self.label[near] != number)]]


def _fit_plane(points: Floats, normal: Floats) -> tuple[Floats, float]:
    """Return the (4,) plane (unit normal, offset) through most points, and their robust spread."""
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
    """Return the heights of the instances over the wall.

    Parameters
    ----------
    mesh : the scan's mesh; face_instance : (F,) int32, 0 = none.
    kinds : instance id to its class, "hold" or "volume".
    unit : scan units per metre.

    Returns
    -------
    Rises by instance id, without instances that have no triangles, that are larger than any mark on
    a wall, or that have too little wall around them.
    """
    bare = _BareWall.of(mesh, face_instance, kinds)
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
        if reach > MAX_RADIUS * unit:
            continue
        ring = bare.around(number, middle, normal, RING * reach)
        if len(ring) >= MIN_RING:
            plane, noise = _fit_plane(ring, normal)
            heights = points @ plane[:3] + plane[3]
            rises[number] = Rise(float(np.percentile(heights, TOP)), noise)
    return rises


def flat_instances(rises: Mapping[int, Rise], unit: float, below: float) -> set[int]:
    """Return the ids of the instances that protrude by less than `below` metres.

    An instance is not flat if the wall around it is rougher than half of `below`: the mesh is too
    noisy to decide.
    """
    return {
        number
        for number, rise in rises.items()
        if rise.height < below * unit and rise.noise < 0.5 * below * unit
    }

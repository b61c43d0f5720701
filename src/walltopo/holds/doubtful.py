"""Which instances a scan shows as holds, and which it only lists as doubtful.

The lift keeps every instance with its score, because who ranks them (a metric, a researcher)
wants all. A setter wants holds: an instance that hardly any view confirms is left out here and
listed for review instead. What lies on a printed plate, or flat on the wall, is no hold either.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mesh
from walltopo.holds.contract import ClassifySettings
from walltopo.holds.cutouts import best_views
from walltopo.holds.flatness import flat_instances, measure_rises
from walltopo.holds.geometry import Shape
from walltopo.holds.observations import HoldView
from walltopo.scans.attributes import Hold, LeftOut
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.old_edits import HoldEdit, find_hold
from walltopo.scans.scale import Plate, Scale
from walltopo.scans.units import unit_of_sizes

__all__ = [
    "Lifted",
    "admitted",
    "doubtful",
    "left_out_rows",
    "on_plates",
]

# Why an instance is left out: the words of `attributes.json`.
FAINT = "few photos confirm it"
PLATED = "lies on a printed plate"
FLAT = "lies flat on the wall"
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
    scores : instance id to its score in [0, 1].
    """

    face_instance: NDArray[np.int32]
    kinds: dict[int, str]
    scores: dict[int, float]

    @classmethod
    def of(cls, table: InstanceTable, records: InstanceRecords) -> Lifted:
        """From the lift's two files."""
        return cls(
            table.face_instance,
            {record.id: record.kind for record in records.instances},
            {record.id: record.score for record in records.instances},
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
    faint = {number for number, score in lifted.scores.items() if score < settings.least_score}
    sizes = [s.size for n, s in shapes.items() if n not in faint and kinds[n] == "hold"]
    unit = unit_of_sizes(sizes, scale.metric, settings.typical_hold)
    present = {number: kinds[number] for number in shapes}
    rises = measure_rises(mesh, lifted.face_instance, present, unit)
    flat = flat_instances(rises, unit, settings.flat_below)
    plated = on_plates({number: shape.position for number, shape in shapes.items()}, scale.plates)
    return dict.fromkeys(faint, FAINT) | dict.fromkeys(flat, FLAT) | dict.fromkeys(plated, PLATED)


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


def admitted(
    holds: Sequence[Hold],
    doubts: Mapping[int, str],
    edits: Sequence[HoldEdit],
    unit: float,
) -> tuple[list[Hold], list[Hold]]:
    """The holds to show and those to leave out: in `doubts`, and not kept by a setter.

    A setter keeps one by `"kept": true` in `holds.edits.json`.
    """
    doubtful_ones = [hold for hold in holds if hold.id in doubts]
    found = (find_hold(doubtful_ones, e.at, e.id, unit) for e in edits if e.kept)
    kept = {hold.id for hold in found if hold is not None}
    shown = [hold for hold in holds if hold.id not in doubts or hold.id in kept]
    return shown, [hold for hold in doubtful_ones if hold.id not in kept]


def left_out_rows(
    holds: Sequence[Hold],
    scores: Mapping[int, float],
    doubts: Mapping[int, str],
    seen: Mapping[int, Sequence[HoldView]],
) -> tuple[list[LeftOut], dict[int, list[HoldView]]]:
    """The list `left_out` of `attributes.json`, the surest first, and the cutouts to keep of it."""
    ranked = sorted(holds, key=lambda hold: (-scores[hold.id], hold.id))
    rows = []
    for hold in ranked:
        shown = hold.rounded()
        score, reason = round(scores[hold.id], 4), doubts[hold.id]
        rows.append(
            LeftOut(hold.id, hold.kind, shown.position, shown.size, hold.photos, score, reason)
        )
    cutouts = {h.id: best_views(seen.get(h.id, ()), CUTOUTS_OF_DOUBTFUL) for h in ranked}
    return rows, cutouts

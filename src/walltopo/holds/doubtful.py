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
from walltopo.scans.attributes import FLAT, Doubtful, Hold
from walltopo.scans.instances import InstanceRecords, InstanceTable
from walltopo.scans.scale import Plate, Scale
from walltopo.scans.units import unit_of_sizes

__all__ = [
    "Lifted",
    "doubtful",
    "left_out",
    "on_plates",
]

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

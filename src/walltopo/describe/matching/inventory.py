"""Count the holds on a wall, and list the changes since another scan of it."""

from __future__ import annotations

import csv
import io
from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from walltopo.core import InputError
from walltopo.describe.matching.holds import match_holds
from walltopo.describe.matching.motions import Motion, Motions
from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.scale import Scale

# Upper limits of the size classes in metres, by the longest extent of the hold.
SIZES = (("XS", 0.06), ("S", 0.10), ("M", 0.16), ("L", 0.26), ("XL", 0.45), ("XXL", np.inf))


def size_class(size: float) -> str:
    """Return the size class: XS up to 6 cm, S 10, M 16, L 26, XL 45, XXL beyond; `size` in m."""
    return next(name for name, limit in SIZES if size <= limit)


@dataclass(frozen=True)
class Row:
    """One line of the inventory: holds that share role, colour, type and size class.

    `area` : total area of their triangles, square metres.
    """

    role: str
    colour: str
    type: str
    size: str
    count: int
    area: float

    def to_json(self) -> dict[str, Any]:
        return {
            "role": self.role,
            "colour": self.colour,
            "type": self.type,
            "size": self.size,
            "count": self.count,
            "area_m2": round(self.area, 5),
        }


def count_holds(holds: Sequence[Hold], unit: float = 1.0) -> list[Row]:
    """Return the inventory, sorted by role, colour, type and size.

    Parameters
    ----------
    unit : scan units per metre (1 for scaled scans).
    """
    groups: dict[tuple[str, str, str, str], list[Hold]] = defaultdict(list)
    for hold in holds:
        groups[hold.role, hold.colour, hold.type, size_class(hold.size / unit)].append(hold)
    order = [name for name, _ in SIZES]
    return [
        Row(*key, len(members), sum(hold.area for hold in members) / unit**2)
        for key, members in sorted(
            groups.items(), key=lambda item: (*item[0][:3], order.index(item[0][3]))
        )
    ]


@dataclass(frozen=True)
class Change:
    """The change of a hold between two scans.

    Parameters
    ----------
    what : "came", "went", "turned", "moved", "recoloured" or "stayed".
    old, new : the hold in either scan; None if the scan does not have it.
    size : its size class.
    motion : as measured; None if it was not, or not to be seen.
    """

    what: str
    old: Hold | None
    new: Hold | None
    size: str
    motion: Motion | None = None

    def to_json(self) -> dict[str, Any]:
        hold = self.new or self.old
        assert hold is not None
        return {
            "what": self.what,
            "old_id": self.old.id if self.old else None,
            "new_id": self.new.id if self.new else None,
            "colour": hold.colour,
            "was_colour": self.old.colour if self.old else None,
            "type": hold.type,
            "role": hold.role,
            "size": self.size,
            "turn_deg": None if self.motion is None else round(self.motion.turn, 1),
            "moved_m": None if self.motion is None else round(self.motion.distance, 4),
            "position": [round(v, 4) for v in hold.position],
        }


def changes(
    old: Sequence[Hold], new: Sequence[Hold], unit: float = 1.0, motions: Motions | None = None
) -> list[Change]:
    """Return the changes between two scans of one wall: by old id, then new holds by new id.

    A hold replaced at its place by one of another size counts as one that went and one that came.
    A hold of equal size and another colour counts as "recoloured". A hold is "turned" or "moved"
    only by the motions.

    Parameters
    ----------
    unit : scan units per metre. motions : as `find_motions` returns them for the same holds.
    """
    measured = motions or {}
    pairs = match_holds(old, new, unit)
    # Holds too far from their old place for a match, which their looks identify.
    pairs |= {
        a: b
        for (a, b), motion in measured.items()
        if a not in pairs and (motion.is_turned or motion.is_moved)
    }
    by_id = {hold.id: hold for hold in new}

    def change(was: Hold | None, now: Hold | None) -> Change:
        hold = now or was
        assert hold is not None
        motion = measured.get((was.id, now.id)) if was and now else None
        return Change(
            _kind_of_change(was, now, motion), was, now, size_class(hold.size / unit), motion
        )

    result = [
        change(hold, by_id.get(pairs.get(hold.id, -1)))
        for hold in sorted(old, key=lambda hold: hold.id)
    ]
    matched = set(pairs.values())
    came = sorted((hold for hold in new if hold.id not in matched), key=lambda hold: hold.id)
    return result + [change(None, hold) for hold in came]


def _kind_of_change(was: Hold | None, now: Hold | None, motion: Motion | None) -> str:
    if was is None or now is None:
        return "came" if was is None else "went"
    if motion is not None and motion.is_turned:
        return "turned"
    if motion is not None and motion.is_moved:
        return "moved"
    return "stayed" if now.colour == was.colour else "recoloured"


def to_csv(rows: Sequence[dict[str, Any]]) -> str:
    """Return CSV text of dictionaries with equal keys; lists become three columns x, y, z."""
    if not rows:
        return ""
    flat = []
    for row in rows:
        line: dict[str, Any] = {}
        for key, value in row.items():
            if isinstance(value, list):
                line |= dict(zip("xyz", value, strict=False))
            else:
                line[key] = value
        flat.append(line)
    out = io.StringIO()
    writer = csv.DictWriter(out, fieldnames=list(flat[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(flat)
    return out.getvalue()


def wall_area(scan: ScanFolder) -> float:
    """Return the area of the scanned mesh in square metres (holds included); 0 without a mesh."""
    if not scan.mesh.is_file():
        return 0.0
    from walltopo.geometry.mesh_files import read_mesh

    return float(read_mesh(scan.mesh).without_guesses().areas.sum())


class ScanHolds(NamedTuple):
    """The holds of a scan and its unit.

    Parameters
    ----------
    metric : whether lengths are metres.
    unit : scan units per metre.
    """

    folder: ScanFolder
    holds: tuple[Hold, ...]
    metric: bool
    unit: float


def load_scan(root: Path) -> ScanHolds:
    """Return the holds of a scan.

    Raises
    ------
    InputError : the folder does not exist, or the scan has not been classified.
    """
    scan = ScanFolder(root)
    if not scan.root.is_dir():
        raise InputError(f"{scan.root}: the scan folder does not exist")
    if not scan.holds.is_file():
        raise InputError(
            f"{scan.holds}: the file does not exist",
            "Run `walltopo scan` up to `classify` first.",
        )
    found = Holds.load(scan.holds)
    return ScanHolds(scan, found.holds, Scale.load(scan.scale).metric, found.unit)

"""Figures of the holds that two scans show as turned, moved or gone, against a worn gym."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from walltopo.core import InputError
from walltopo.describe.matching.inventory import Change, changes, load_scan
from walltopo.describe.matching.motions import find_motions
from walltopo.describe.matching.patches import read_textured_wall
from walltopo_lab.evaluate.align import align_views, same_holds
from walltopo_lab.evaluate.scan import scan_views
from walltopo_lab.evaluate.truth import read_truth
from walltopo_lab.synth.wear import Wear, read_wear

SURE_DEG: Final = 15.0  # turns from which recall counts


@dataclass(frozen=True)
class HoldRow:
    """A hold of the first scan: what happened to it, and what was found."""

    id: int
    turned: float
    shifted: float
    is_gone: bool
    found: Change

    @property
    def is_untouched(self) -> bool:
        return not (self.turned or self.shifted or self.is_gone)


def compare_scans(old: Path, new: Path, gym: Path, later: Path) -> list[HoldRow]:
    """Return a row for each hold of a scan that its gym has too.

    Parameters
    ----------
    old, new : scans of the photos of both gyms, the second with `--reference old`.
    gym : folder of `walltopo synth`. later : the same gym after wear.

    Raises
    ------
    InputError : a folder is no scan or no gym, or the gyms do not belong together.
    """
    wear, truth = read_wear(later), read_truth(gym)
    first, second = load_scan(old), load_scan(new)
    walls = [read_textured_wall(one.folder, one.unit) for one in (first, second)]
    motions = find_motions(walls[0], walls[1], first.holds, second.holds)
    found = changes(first.holds, second.holds, first.unit, motions)
    frame = align_views(scan_views(first.folder, truth), truth.views, similarity=True)
    places = frame.apply(np.array([hold.position for hold in first.holds]))
    true = {one.id: one.position for one in truth.instances.values() if one.kind != "volume"}
    if not true:
        raise InputError(f"{gym}: the gym has no holds")
    known = same_holds(first.holds, places, true)
    return [
        _row(known[one.old.id], wear, one)
        for one in found
        if one.old is not None and one.old.kind == "hold" and known[one.old.id]
    ]


def _row(number: int, wear: Wear, found: Change) -> HoldRow:
    turned, shifted = wear.turned.get(number, 0.0), wear.shifted.get(number, 0.0)
    return HoldRow(number, turned, shifted, number in wear.gone, found)


def loose_figures(rows: Sequence[HoldRow]) -> dict[str, Any]:
    """Return the figures, JSON-able.

    Returns
    -------
    untouched : holds that did not change. false_alarms : of these, found turned or moved.
    turned, turned_found : holds that turned by `SURE_DEG` or more, and found so.
    turn_error_median_deg : of those found. turned_less, turned_less_found : by less.
    moved, moved_found : holds that shifted; found moved, or turned.
    gone, gone_found : holds that are gone, and found so.
    """
    untouched = [row for row in rows if row.is_untouched]
    alarms = [row for row in untouched if row.found.what in ("turned", "moved")]
    turned = [row for row in rows if abs(row.turned) >= SURE_DEG]
    less = [row for row in rows if 0 < abs(row.turned) < SURE_DEG]
    shifted = [row for row in rows if row.shifted]
    gone = [row for row in rows if row.is_gone]
    seen = [row for row in turned if row.found.what == "turned"]
    errors = [abs(row.found.motion.turn - row.turned) for row in seen if row.found.motion]
    return {
        "untouched": len(untouched),
        "false_alarms": len(alarms),
        "turned": len(turned),
        "turned_found": len(seen),
        "turn_error_median_deg": round(float(np.median(errors)), 2) if errors else None,
        "turned_less": len(less),
        "turned_less_found": sum(row.found.what == "turned" for row in less),
        "moved": len(shifted),
        "moved_found": sum(row.found.what in ("moved", "turned") for row in shifted),
        "gone": len(gone),
        "gone_found": sum(row.found.what == "went" for row in gone),
    }

"""A setter's corrections of single holds, put on what the program found.

Corrections that find no hold are left out and told, they never fail a run.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from msgspec.structs import replace

from walltopo.scans.attributes import Hold
from walltopo.scans.old_edits import HoldEdit, find_hold

__all__ = ["apply_hold_edits"]


def _with_kind(hold: Hold, kind: str) -> Hold:
    if kind == hold.kind:
        return hold
    if kind == "volume":
        return replace(hold, kind=kind, role="volume", type="volume", type_confidence=1.0)
    return replace(hold, kind=kind, role="hold", type="unknown", type_confidence=0.0)


def _repainted(hold: Hold, colour: str, holds: Sequence[Hold]) -> Hold:
    """The hold with a corrected colour: its name, and the paint of the others called so.

    Routes go by paint, so a hold that keeps the paint it was seen with would stay in its route.
    """
    paints = [other.colour_rgb for other in holds if other.colour == colour and other.id != hold.id]
    red, green, blue = np.median(paints, axis=0).round() if paints else hold.colour_rgb
    rgb = int(red), int(green), int(blue)
    return replace(hold, colour=colour, colour_confidence=1.0, colour_rgb=rgb)


def apply_hold_edits(
    holds: Sequence[Hold], edits: Sequence[HoldEdit], unit: float
) -> tuple[list[Hold], list[str]]:
    """Correct class, colour and type of holds, and take deleted ones out.

    A corrected colour or type has confidence 1, and the hold needs no review any more.

    Returns
    -------
    The holds, and one line per edit that found no hold.
    """
    current = {hold.id: hold for hold in holds}
    lost: list[str] = []
    for edit in edits:
        hold = find_hold(holds, edit.at, edit.id, unit)
        if hold is None or hold.id not in current:
            lost.append(f"edit of hold {edit.id}: no hold there any more")
            continue
        if edit.deleted:
            del current[hold.id]
            continue
        changed = _with_kind(current[hold.id], edit.kind or hold.kind)
        if edit.colour is not None:
            changed = _repainted(changed, edit.colour, holds)
        if edit.type is not None:
            changed = replace(changed, type=edit.type, type_confidence=1.0)
        current[hold.id] = replace(changed, review=False)
    return list(current.values()), lost

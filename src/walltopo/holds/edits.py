"""A setter's corrections of single holds, put on what the program found.

Corrections that find no hold are left out and told, they never fail a run.
"""

from __future__ import annotations

from collections.abc import Sequence

from msgspec.structs import replace

from walltopo.scans.attributes import Hold
from walltopo.scans.edits import HoldEdit, find_hold

__all__ = ["apply_hold_edits"]


def _with_kind(hold: Hold, kind: str) -> Hold:
    if kind == hold.kind:
        return hold
    if kind == "volume":
        return replace(hold, kind=kind, role="volume", type="volume", type_confidence=1.0)
    return replace(hold, kind=kind, role="hold", type="unknown", type_confidence=0.0)


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
            changed = replace(changed, colour=edit.colour, colour_confidence=1.0)
        if edit.type is not None:
            changed = replace(changed, type=edit.type, type_confidence=1.0)
        current[hold.id] = replace(changed, review=False)
    return list(current.values()), lost

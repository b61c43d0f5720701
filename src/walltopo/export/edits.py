"""What the editor reads and saves: both edit files as one JSON document."""

from __future__ import annotations

from typing import Any

from walltopo.core import InputError
from walltopo.scans.edits import (
    check_hold_edits,
    check_route_edits,
    read_hold_edits,
    read_route_edits,
    write_hold_edits,
    write_route_edits,
)
from walltopo.scans.folder import ScanFolder

__all__ = ["read_edits", "save_edits"]


def read_edits(scan: ScanFolder) -> dict[str, Any]:
    """`{"holds": holds.edits.json, "routes": routes.edits.toml}`."""
    return {
        "holds": read_hold_edits(scan.hold_edits),
        "routes": read_route_edits(scan.route_edits),
    }


def save_edits(scan: ScanFolder, edits: Any) -> None:
    """Write both edit files; nothing is written if either part is broken.

    Raises
    ------
    InputError : the document is not what `read_edits` gives.
    """
    if not isinstance(edits, dict) or set(edits) != {"holds", "routes"}:
        raise InputError("edits: expected an object with `holds` and `routes`")
    holds = check_hold_edits(edits["holds"], "edits of holds")
    routes = check_route_edits(edits["routes"], "edits of routes")
    write_hold_edits(scan.hold_edits, holds)
    write_route_edits(scan.route_edits, routes)

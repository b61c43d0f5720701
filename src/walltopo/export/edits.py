"""What the editor reads and saves: both edit files as one JSON document."""

from __future__ import annotations

from typing import Any

import msgspec

from walltopo.scans.document import parse
from walltopo.scans.edits import HoldEdits, RouteEdits
from walltopo.scans.folder import ScanFolder

__all__ = ["EditDocument", "read_edits", "save_edits"]


class EditDocument(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """`{"holds": holds.edits.json, "routes": routes.edits.toml}`."""

    holds: HoldEdits
    routes: RouteEdits


def read_edits(scan: ScanFolder) -> dict[str, Any]:
    """The edits of a scan, JSON-able."""
    edits = EditDocument(HoldEdits.load(scan.hold_edits), RouteEdits.load(scan.route_edits))
    plain: dict[str, Any] = msgspec.to_builtins(edits)
    return plain


def save_edits(scan: ScanFolder, edits: object) -> None:
    """Write both edit files; nothing is written if either part is broken.

    Raises
    ------
    InputError : the document is not what `read_edits` gives.
    """
    document = parse(edits, EditDocument, "edits")
    document.holds.save(scan.hold_edits)
    document.routes.save(scan.route_edits)

"""Read the holds and routes of a scan folder, for movement and problem setting."""

from __future__ import annotations

from pathlib import Path

from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import Hold
from walltopo.scans.routes import Route


def read_wall(path: Path) -> tuple[tuple[Hold, ...], tuple[Route, ...], float]:
    """Return holds and routes of a scan, and the scan units per metre.

    Raises
    ------
    InputError : the scan has no holds or routes yet, or they are damaged.
    """
    folder = ScanFolder(path)
    holds = ScanFolder.holds.load(folder)
    return holds.holds, ScanFolder.routes.load(folder).routes, holds.unit

"""Holds and routes of a scan folder, as movement and problem setting need them."""

from __future__ import annotations

from pathlib import Path

from walltopo.scans.folder import ScanFolder
from walltopo.scans.holds import HoldRow
from walltopo.scans.routes import Route


def read_wall(path: Path) -> tuple[tuple[HoldRow, ...], tuple[Route, ...], float]:
    """Return holds and routes of a scan, and how many units a metre is.

    Raises
    ------
    InputError : the scan has no holds or routes yet, or they are damaged.
    """
    folder = ScanFolder(path)
    holds = ScanFolder.holds.load(folder)
    return holds.holds, ScanFolder.routes.load(folder).routes, holds.unit

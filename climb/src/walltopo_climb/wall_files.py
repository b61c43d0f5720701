"""Holds and routes of a scan folder, as movement and problem setting need them."""

from __future__ import annotations

from pathlib import Path

from walltopo.describe.routes.settings import RoutesSettings
from walltopo.scan.folder import ScanFolder
from walltopo.scan.holds import HoldRow
from walltopo.scan.routes import Route
from walltopo.scan.scale import unit_of_sizes


def read_wall(path: Path) -> tuple[tuple[HoldRow, ...], tuple[Route, ...], float]:
    """Return holds and routes of a scan, and how many units a metre is.

    Raises
    ------
    InputError : the scan has no holds or routes yet, or they are damaged.
    """
    folder = ScanFolder(path)
    holds = ScanFolder.holds.load(folder)
    sizes = (hold.size for hold in holds.holds if hold.role == "hold")
    unit = unit_of_sizes(sizes, holds.metric, RoutesSettings().typical_hold)
    return holds.holds, ScanFolder.routes.load(folder).routes, unit

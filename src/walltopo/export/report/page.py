"""Putting the report's sections together."""

from __future__ import annotations

import html

from walltopo.export.params import ExportSettings
from walltopo.export.surface import Surface
from walltopo.export.wall import Wall
from walltopo.workspace import ScanFolder, atomic_path

__all__ = ["write_report"]


def write_report(scan: ScanFolder, wall: Wall, first: Surface, settings: ExportSettings) -> None:
    """Write `report.html`, one file without links to the outside."""
    del first, settings
    title = html.escape(wall.title)
    text = (
        f"<!doctype html><meta charset=utf-8><title>{title}: report</title><h1>{title}</h1>"
        f"<p>{len(wall.holds)} holds and volumes, {len(wall.routes)} routes."
    )
    with atomic_path(scan.report) as temporary:
        temporary.write_text(text, encoding="utf-8")

"""Artifacts of a scan kept in memory, as long as their files are what they were."""

from __future__ import annotations

from typing import Any

from walltopo.pipeline.ledger import stamp
from walltopo.scans.artifacts import load_artifact
from walltopo.scans.folder import ScanFolder

__all__ = ["Shelf"]


class Shelf:
    """Loads as `load_artifact` does; gives the same object while nothing about the file changed."""

    def __init__(self) -> None:
        self._kept: dict[str, tuple[str, Any]] = {}

    def load(self, folder: ScanFolder, name: str) -> Any:
        """The value of an artifact; raises what `load_artifact` raises."""
        now = stamp(getattr(folder, name))
        kept = self._kept.get(name)
        if kept is None or kept[0] != now:
            self._kept[name] = kept = (now, load_artifact(folder, name))
        return kept[1]

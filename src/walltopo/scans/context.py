"""What a stage is given besides its inputs and settings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from walltopo.core import Progress, Silent
from walltopo.scans.manifest import StageRecord


@dataclass(frozen=True)
class Context:
    """Where a stage works and whom it tells.

    Parameters
    ----------
    scratch : an empty folder on the scan's disk, gone after the stage: what is to be stored is
        made here and moved to its place.
    cache : the scan's `work/`: may be deleted at any time, and is only there to save time.
    progress : told of the steps.
    title : the scan's name, for people.
    records : what the stages said in their last runs, by name; for reports, never for results.
    """

    scratch: Path
    cache: Path
    progress: Progress = field(default_factory=Silent)
    title: str = ""
    records: Mapping[str, StageRecord] = field(default_factory=dict)

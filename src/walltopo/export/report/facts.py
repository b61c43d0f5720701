"""What the report tells of a scan, besides its wall."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from walltopo.core import View
from walltopo.export.contract import Reads
from walltopo.scans.attributes import LeftOut
from walltopo.scans.manifest import StageRecord
from walltopo.scans.photo_list import Photo, SkippedFile
from walltopo.scans.photo_set import PhotoSet
from walltopo.scans.scale import Scale

__all__ = ["Facts"]


@dataclass(frozen=True, eq=False)
class Facts:
    """Photos, stages and scale of one scan.

    Parameters
    ----------
    photos, skipped : what ingest kept and left out; folder : where the photos are.
    views : registered photos, by name.
    unregistered : photo name to the reason ("" where none is known).
    stages : what the stages said in their last runs.
    cutouts : instance id to the file of its best cutout.
    left_out : instances that were too doubtful to be holds, the surest first.
    """

    photos: tuple[Photo, ...]
    skipped: tuple[SkippedFile, ...]
    folder: PhotoSet
    views: tuple[View, ...]
    unregistered: dict[str, str]
    stages: Mapping[str, StageRecord]
    scale: Scale
    cutouts: dict[int, Path]
    left_out: tuple[LeftOut, ...]

    @classmethod
    def of(cls, reads: Reads, records: Mapping[str, StageRecord]) -> Facts:
        """From what the export stage is given."""
        views = reads.sparse.views
        known = {view.name for view in views}
        sparse = records.get("sparse")
        reasons = sparse.metrics.get("unregistered", {}) if sparse else {}
        return cls(
            photos=reads.photo_list.photos,
            skipped=reads.photo_list.skipped,
            folder=reads.photos,
            views=views,
            unregistered={
                photo.name: str(reasons.get(photo.name, ""))
                for photo in reads.photo_list.photos
                if photo.name not in known
            },
            stages=records,
            scale=reads.scale,
            cutouts=reads.cutouts.best(),
            left_out=reads.attributes.left_out,
        )

    def metric(self, stage: str, key: str) -> Any:
        """One figure of a stage, or None."""
        record = self.stages.get(stage)
        return record.metrics.get(key) if record else None

"""The stage `ingest`: sources to upright sRGB photos: `photos/` and `photos.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Stage
from walltopo.reconstruct.ingest.settings import IngestSettings
from walltopo.scans.artifacts import figures, of
from walltopo.scans.context import Context
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet
from walltopo.scans.sources import SourceList


@dataclass(frozen=True)
class Reads:
    """What the stage is given."""

    sources: SourceList = of(ScanFolder.sources)


@dataclass(frozen=True)
class Writes:
    """What the stage makes."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    metrics: Metrics = figures()


def run(reads: Reads, settings: IngestSettings, context: Context) -> Writes:
    """Sources to upright sRGB photos: `photos/` and `photos.json`."""
    from walltopo.reconstruct.ingest.selection import select_photos

    return Writes(*select_photos(reads.sources, settings, context))


INGEST = Stage("ingest", Reads, Writes, run)

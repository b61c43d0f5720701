"""Run the stage `ingest`: sources to upright sRGB photos in `photos/`, and `photos.json`."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import IngestSettings
from walltopo.scans.artifacts import Context, figures, of
from walltopo.scans.folder import ScanFolder
from walltopo.scans.manifest import Metrics
from walltopo.scans.photos import PhotoList, PhotoSet, SourceList


@dataclass(frozen=True)
class Reads:
    """The artifacts that the stage reads."""

    sources: SourceList = of(ScanFolder.sources)


@dataclass(frozen=True)
class Writes:
    """The artifacts and metrics that the stage writes."""

    photos: PhotoSet = of(ScanFolder.photos)
    photo_list: PhotoList = of(ScanFolder.photo_list)
    metrics: Metrics = figures()


def run(reads: Reads, settings: IngestSettings, context: Context) -> Writes:
    """Convert the sources to upright sRGB photos."""
    from walltopo.reconstruct.ingest.selection import select_photos

    return Writes(*select_photos(reads.sources, settings, context))


MODELS = ("people.onnx",)
INGEST = Stage("ingest", Reads, Writes, run, models=MODELS, cost=Cost(0.3, 0.11))

"""Run the stage `join`: make the whole wall of a partial rescan and its reference."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.pipeline.partial.files import JoinedFiles, ReferenceFiles, WallFiles
from walltopo.pipeline.stage import Cost, Stage
from walltopo.reconstruct.settings import SparseSettings
from walltopo.scans.artifacts import Context, scan_of

# The other scans of which the stage reads artifacts.
PART = "part"
REFERENCE = "reference"


@dataclass(frozen=True, eq=False)
class Reads:
    """The artifacts that the stage reads."""

    part: WallFiles = scan_of(WallFiles, PART)
    reference: ReferenceFiles = scan_of(ReferenceFiles, REFERENCE)


def run(reads: Reads, settings: SparseSettings, context: Context) -> JoinedFiles:
    """Replace the part of the reference's wall that the new photos show.

    Metrics: faces and area of the mesh, holds, volumes, and a summary of what was replaced.

    Raises
    ------
    InputError : the scans are in different frames.
    StageError : the photos show nothing of the reference's wall.
    """
    from walltopo.pipeline.partial.colours import colours_of
    from walltopo.pipeline.partial.join import join_with_reference

    colours = colours_of(settings.part_colours)
    return join_with_reference(reads.part, reads.reference, colours, context)


JOIN = Stage("join", Reads, JoinedFiles, run, cost=Cost(5, 0.1), section="sparse")

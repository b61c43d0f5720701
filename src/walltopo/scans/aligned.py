"""`work/aligned.json`: the reference into whose frame the photos were registered."""

from __future__ import annotations

from walltopo.scans.document import Document
from walltopo.scans.scale import Frame

__all__ = ["Aligned"]


class Aligned(Document, frozen=True, kw_only=True):
    """How a scan was aligned to a reference.

    Parameters
    ----------
    reference : the reference's scan folder.
    align : "constrained" or "rigid".
    reference_moved : largest change of any number in the reference's poses and intrinsics.
    shared_points : points that tie the two together.
    frame : what is known of the reference's world frame.
    reference_frame : what identifies it (see `world_frame`).
    """

    reference: str
    align: str
    reference_moved: float
    shared_points: int
    frame: Frame
    reference_frame: str = ""

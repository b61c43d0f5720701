"""Whether scans share a world frame: by what identifies it, not by where a folder lies."""

from __future__ import annotations

from walltopo.core.files import hash_path
from walltopo.scans.folder import ScanFolder
from walltopo.scans.scale import Scale

__all__ = ["world_frame"]


def world_frame(scan: ScanFolder) -> str:
    """What identifies the world frame of a scan; "" where an older walltopo did not note it.

    A scan with a frame of its own is identified by the content of its model: scanned or measured
    anew it has another frame, although its folder keeps its name. A scan that was registered into
    a reference has the reference's.

    Raises
    ------
    InputError : its `scale.json` is missing or damaged.
    """
    scale = Scale.load(scan.scale)
    return scale.reference_frame if scale.method == "reference" else hash_path(scan.sparse)

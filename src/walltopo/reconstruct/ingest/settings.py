"""Settings of the ingest stage."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from walltopo.core import about, check_settings


@dataclass(frozen=True)
class IngestSettings:
    """What counts as a usable photo, and how frames are picked from a video."""

    max_side: Annotated[
        int, about("larger photos are reduced to this longest side", unit="px", low=640, high=20000)
    ] = 3200
    min_side: Annotated[
        int,
        about("photos whose shorter side is below this are skipped", unit="px", low=64, high=4000),
    ] = 320
    max_aspect: Annotated[
        float,
        about(
            "photos longer than this ratio (panoramas) are skipped",
            low=1.0,
            high=100.0,
            expert=True,
        ),
    ] = 2.6
    video_max_frames: Annotated[
        int, about("most frames taken from one video", unit="frames", low=3, high=5000)
    ] = 150

    def __post_init__(self) -> None:
        check_settings(self, "ingest")

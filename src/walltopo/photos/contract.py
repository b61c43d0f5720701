"""Settings of the ingest stage."""

from __future__ import annotations

from dataclasses import dataclass

from walltopo.core import check_settings, setting

__all__ = ["IngestSettings"]


@dataclass(frozen=True)
class IngestSettings:
    """What counts as a usable photo, and how frames are picked from a video."""

    max_side: int = setting(
        3200, "larger photos are reduced to this longest side", unit="px", low=640, high=20000
    )
    min_side: int = setting(
        320, "photos whose shorter side is below this are skipped", unit="px", low=64, high=4000
    )
    max_aspect: float = setting(
        2.6, "photos longer than this ratio (panoramas) are skipped", low=1.0, high=100.0
    )
    min_sharpness: float = setting(
        3.0, "variance of the Laplacian at 1024 px below which a photo is blurred", low=0.0
    )
    relative_sharpness: float = setting(
        0.04, "photos below this share of the set's median sharpness are blurred", low=0, high=1
    )
    duplicate_difference: float = setting(
        0.6, "mean grey difference (of 255) under which two photos are the same", low=0.0
    )
    video_motion: float = setting(
        0.08, "camera motion between kept video frames, as a share of the width", low=0, high=1
    )
    video_max_frames: int = setting(
        150, "most frames taken from one video", unit="frames", low=3, high=5000
    )

    def __post_init__(self) -> None:
        check_settings(self, "ingest")

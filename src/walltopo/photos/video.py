"""Frames of a video: the sharpest one of each stretch of camera motion."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.photos.contract import IngestSettings
from walltopo.photos.quality import motion, sharpness, thumbnail

__all__ = ["VIDEO_SUFFIXES", "pick_frames"]

VIDEO_SUFFIXES = {".mp4", ".mov", ".m4v", ".avi", ".mkv", ".webm"}
_LOOK_RATE_HZ = 6.0  # frames looked at per second; walking pace needs no more
_MOTION = 0.08  # camera motion between kept frames, as a share of the width

Rgb = NDArray[np.uint8]


def pick_frames(path: Path, settings: IngestSettings) -> list[tuple[str, Rgb]]:
    """Names and pixels of the frames worth keeping.

    The camera's motion is added up frame by frame; whenever it passes
    `_MOTION` of the width, the sharpest frame of that stretch is kept.

    Raises
    ------
    InputError : the file has no video stream or cannot be decoded (the reason alone).
    """
    kept: list[tuple[str, Rgb]] = []
    best: tuple[float, int, Rgb] | None = None
    before: NDArray[np.float32] | None = None
    travelled = 0.0
    for number, frame in _look(path):
        small = thumbnail(frame, 128)
        travelled += motion(before, small) if before is not None else 0.0
        before = small
        quality = sharpness(frame)
        if best is None or quality > best[0]:
            best = (quality, number, frame)
        if travelled >= _MOTION:
            kept.append((f"{path.stem}_{best[1]:06d}", best[2]))
            best, travelled = None, 0.0
    if best is not None and (not kept or travelled >= _MOTION / 2):
        kept.append((f"{path.stem}_{best[1]:06d}", best[2]))
    if len(kept) > settings.video_max_frames:
        chosen = np.linspace(0, len(kept) - 1, settings.video_max_frames).round().astype(int)
        kept = [kept[i] for i in chosen]
    return kept


def _look(path: Path) -> Iterator[tuple[int, Rgb]]:
    """Upright frames at about `_LOOK_RATE_HZ`, with their numbers in the file."""
    import av

    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise InputError("has no video stream")
            stream = container.streams.video[0]
            stream.thread_type = "AUTO"
            rate = float(stream.average_rate or 30.0)
            stride = max(1, round(rate / _LOOK_RATE_HZ))
            for number, frame in enumerate(container.decode(stream)):
                if number % stride == 0:
                    turns = round(float(getattr(frame, "rotation", 0) or 0) / 90.0) % 4
                    image = np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
                    yield number, np.ascontiguousarray(np.rot90(image, turns))
    except av.error.FFmpegError as error:
        raise InputError(f"cannot be decoded as a video ({error.strerror})") from error

"""Frames of a video: the sharpest one of each stretch of camera motion."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.reconstruct.ingest.image_file import motion, sharpness, thumbnail
from walltopo.reconstruct.ingest.memory_gate import Room, bytes_of_frame

_LOOK_RATE_HZ = 6.0  # frames looked at per second; walking pace needs no more
_MOTION = 0.08  # camera motion between kept frames, as a share of the width
# A film beyond it is looked at up to here. Slow motion has at most 240 frames a second.
_LONGEST_MINUTES: Final = 30
_MOST_LOOKS: Final = int(_LONGEST_MINUTES * 60 * _LOOK_RATE_HZ)
_FASTEST_HZ: Final = 240.0
_LARGEST_FRAME: Final = 40_000_000  # 8K has 33 million pixels
_DECODER_THREADS: Final = 2  # each holds frames of its own

Rgb = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Frame:
    """One frame: its number in the file, (H, W, 3) sRGB, and how sharp it is."""

    number: int
    pixels: Rgb
    sharpness: float


def sharpest_frames(path: Path, room: Room, untold: list[str]) -> Iterator[Frame]:
    """The frames worth keeping, one at a time: no more than two are ever in memory.

    The camera's motion is added up frame by frame; whenever it passes `_MOTION` of the width, the
    sharpest frame of that stretch is given.

    Parameters
    ----------
    untold : given a sentence where the film goes on beyond what was looked at.

    Raises
    ------
    InputError : the file has no video stream or cannot be decoded (the reason alone).
    """
    best: Frame | None = None
    before: NDArray[np.float32] | None = None
    travelled, given = 0.0, False
    for number, pixels in _looks(path, room, untold):
        small = thumbnail(pixels, 128)
        travelled += motion(before, small) if before is not None else 0.0
        before = small
        quality = sharpness(pixels)
        if best is None or quality > best.sharpness:
            best = Frame(number, pixels, quality)
        if travelled >= _MOTION:
            yield best
            best, travelled, given = None, 0.0, True
    if best is not None and (not given or travelled >= _MOTION / 2):
        yield best


def _looks(path: Path, room: Room, untold: list[str]) -> Iterator[tuple[int, Rgb]]:
    """Upright frames at about `_LOOK_RATE_HZ`, with their numbers in the file."""
    import av

    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise InputError("has no video stream")
            stream = container.streams.video[0]
            with room.taken(_bytes(stream)):
                yield from _decoded(container, stream, untold)
    except MemoryError:
        raise
    except (av.error.FFmpegError, OSError) as error:
        raise InputError(f"cannot be decoded as a video ({error.strerror})") from error


def _bytes(stream: Any) -> float:
    """What the stream's header says it takes; InputError where that is no film of a phone."""
    if stream.codec_context is None:
        raise InputError("its codec is not known here")
    width, height = stream.codec_context.width, stream.codec_context.height
    if width * height > _LARGEST_FRAME:
        raise InputError(f"{width}x{height} pixels a frame, too large to be a phone's video")
    pixel = stream.codec_context.format
    bits = max((part.bits for part in pixel.components), default=8) if pixel else 8
    return bytes_of_frame(width, height, bits)


def _decoded(container: Any, stream: Any, untold: list[str]) -> Iterator[tuple[int, Rgb]]:
    stream.thread_type = "AUTO"
    stream.codec_context.thread_count = _DECODER_THREADS
    rate = min(float(stream.average_rate or 30.0), _FASTEST_HZ)
    stride = max(1, round(rate / _LOOK_RATE_HZ))
    for number, frame in enumerate(container.decode(stream)):
        if number >= _MOST_LOOKS * stride:
            untold.append(f"only its first {_LONGEST_MINUTES} minutes were looked at")
            return
        if number % stride == 0:
            turns = round(float(getattr(frame, "rotation", 0) or 0) / 90.0) % 4
            image = np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
            yield number, np.ascontiguousarray(np.rot90(image, turns))

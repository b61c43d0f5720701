"""Read the frames of a video: the sharpest of each stretch of camera motion, or those of a rate."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError
from walltopo.images.hdr import TRANSFERS, to_srgb8
from walltopo.reconstruct.ingest.decoding import MemoryBudget, bytes_of_frame
from walltopo.reconstruct.ingest.image_file import motion, sharpness, thumbnail

_SAMPLE_RATE_HZ = 6.0  # frames examined per second; enough for walking pace
_MOTION = 0.08  # camera motion between kept frames, as a share of the width
# Longer videos are read up to this time. Slow motion has at most 240 frames per second.
_MAX_MINUTES: Final = 30
_MAX_SAMPLES: Final = int(_MAX_MINUTES * 60 * _SAMPLE_RATE_HZ)
_FASTEST_HZ: Final = 240.0
_MAX_FRAME_PIXELS: Final = 40_000_000  # 8K has 33 million pixels
_DECODER_THREADS: Final = 2  # each holds frames of its own

Rgb = NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class Frame:
    """A video frame: its number in the file, (H, W, 3) sRGB pixels and its sharpness."""

    number: int
    pixels: Rgb
    sharpness: float


def sharpest_frames(path: Path, budget: MemoryBudget, reasons: list[str]) -> Iterator[Frame]:
    """Yield the frames to keep, one at a time; at most two are in memory.

    The camera's motion is summed frame by frame. When the sum passes `_MOTION` of the width, the
    sharpest frame of that stretch is yielded.

    Parameters
    ----------
    budget : memory budget of the decoding process.
    reasons : receives a sentence if the end of the video was not read.

    Raises
    ------
    InputError : the file has no video stream or cannot be decoded; the message omits its name.
    """
    best: Frame | None = None
    before: NDArray[np.float32] | None = None
    travelled, has_yielded = 0.0, False
    for number, pixels in _sample_frames(path, budget, reasons):
        small = thumbnail(pixels, 128)
        travelled += motion(before, small) if before is not None else 0.0
        before = small
        quality = sharpness(pixels)
        if best is None or quality > best.sharpness:
            best = Frame(number, pixels, quality)
        if travelled >= _MOTION:
            yield best
            best, travelled, has_yielded = None, 0.0, True
    if best is not None and (not has_yielded or travelled >= _MOTION / 2):
        yield best


class LongVideoError(InputError):
    """The video is longer than its reader accepts."""


def timed_frames(
    path: Path, rate: float, max_seconds: float, max_side: int
) -> Iterator[tuple[float, Rgb]]:
    """Yield the times in seconds and the upright pixels of a video's frames, one at a time.

    The time is that of the file, so that a variable frame rate does no harm.

    Parameters
    ----------
    rate : frames per second at most. max_side : of a frame; larger ones are reduced, pixels.

    Raises
    ------
    InputError : the file has no video stream, or cannot be decoded.
    LongVideoError : it is longer than `max_seconds`.
    """
    with _open_video(path) as (container, stream):
        last: int | None = None
        for number, frame in enumerate(container.decode(stream)):
            time = frame.time if frame.time is not None else number / _FASTEST_HZ
            if time > max_seconds:
                raise LongVideoError(f"is longer than {max_seconds:.0f} seconds")
            slot = int(time * rate + 1e-6)  # the first frame of each
            if slot == last:
                continue
            last = slot
            yield float(time), _reduce_frame(_upright_pixels(frame), max_side)


def _sample_frames(
    path: Path, budget: MemoryBudget, reasons: list[str]
) -> Iterator[tuple[int, Rgb]]:
    """Yield upright frames at about `_SAMPLE_RATE_HZ`, with their numbers in the file."""
    with _open_video(path) as (container, stream), budget.reserve(_memory_needed(stream)):
        yield from _decode(container, stream, reasons)


@contextmanager
def _open_video(path: Path) -> Iterator[tuple[Any, Any]]:
    """Open a video; yield the container and its first video stream.

    Raises
    ------
    InputError : the file has no video stream, or cannot be decoded.
    """
    import av

    try:
        with av.open(str(path)) as container:
            if not container.streams.video:
                raise InputError("has no video stream")
            stream = container.streams.video[0]
            _check_frames(stream)
            stream.thread_type = "AUTO"
            stream.codec_context.thread_count = _DECODER_THREADS
            yield container, stream
    except MemoryError:
        raise
    except (av.error.FFmpegError, OSError) as error:
        raise InputError(f"cannot be decoded as a video ({error.strerror})") from error


def _check_frames(stream: Any) -> None:
    """Raise InputError if no phone records such frames, by the video's header."""
    if stream.codec_context is None:
        raise InputError("its codec is not known here")
    width, height = stream.codec_context.width, stream.codec_context.height
    if width * height > _MAX_FRAME_PIXELS:
        raise InputError(f"{width}x{height} pixels a frame, too large to be a phone's video")


def _memory_needed(stream: Any) -> float:
    """Return the memory that the header of a checked video implies."""
    width, height = stream.codec_context.width, stream.codec_context.height
    pixel = stream.codec_context.format
    bits = max((part.bits for part in pixel.components), default=8) if pixel else 8
    return bytes_of_frame(width, height, bits)


def _decode(container: Any, stream: Any, reasons: list[str]) -> Iterator[tuple[int, Rgb]]:
    rate = min(float(stream.average_rate or 30.0), _FASTEST_HZ)
    stride = max(1, round(rate / _SAMPLE_RATE_HZ))
    for number, frame in enumerate(container.decode(stream)):
        if number >= _MAX_SAMPLES * stride:
            reasons.append(f"only its first {_MAX_MINUTES} minutes were looked at")
            return
        if number % stride == 0:
            yield number, _upright_pixels(frame)


def _upright_pixels(frame: Any) -> Rgb:
    """Return a frame's (H, W, 3) sRGB pixels, turned as the file says."""
    turns = round(float(getattr(frame, "rotation", 0) or 0) / 90.0) % 4
    return np.ascontiguousarray(np.rot90(_srgb_pixels(frame), turns))


def _reduce_frame(pixels: Rgb, max_side: int) -> Rgb:
    """Return a frame whose longer side is at most `max_side`, in pixels."""
    import cv2

    factor = max_side / max(pixels.shape[:2])
    if factor >= 1:
        return pixels
    small = cv2.resize(pixels, None, fx=factor, fy=factor, interpolation=cv2.INTER_AREA)
    return np.asarray(small, np.uint8)


def _srgb_pixels(frame: Any) -> Rgb:
    """Return a frame's (H, W, 3) sRGB pixels; HDR frames (HLG, PQ) are tone-mapped."""
    transfer = TRANSFERS.get(int(frame.color_trc))
    if transfer is None:
        return np.asarray(frame.to_ndarray(format="rgb24"), dtype=np.uint8)
    return to_srgb8(np.asarray(frame.to_ndarray(format="rgb48le"), dtype=np.uint16), transfer)


def video_seconds(path: Path) -> float:
    """Return the duration that a video's header declares; infinity if it declares none.

    Raises
    ------
    InputError : the file cannot be opened as a video; the message omits its name.
    """
    import av

    try:
        with av.open(str(path)) as container:
            if container.duration is None:
                return float("inf")
            return float(container.duration) / float(av.time_base)
    except (av.error.FFmpegError, OSError) as error:
        raise InputError(f"cannot be decoded as a video ({error.strerror})") from error

"""Decode photos in a child process with limited memory; skip photos that crash it."""

from __future__ import annotations

import os
import tempfile
import threading
from collections.abc import Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Final, TypeAlias

import msgspec

from walltopo.core import EnvironmentLacksError, InputError, Progress, StageError
from walltopo.core.children import child_process, describe_exit, python_module
from walltopo.core.parallel import library_threads
from walltopo.reconstruct.settings import IngestSettings

if TYPE_CHECKING:
    from PIL.Image import Image


_THREADS: Final = 4


def decode_files(
    files: Sequence[tuple[int, Path]], folder: Path, settings: IngestSettings, progress: Progress
) -> Generator[Done]:
    """Yield the result of each numbered file, in the order in which the files finish.

    If the process crashes or runs out of memory, the files in progress are decoded again, each in a
    process of its own. A file that crashes the process again is skipped.

    Raises
    ------
    EnvironmentLacksError : the disk is full.
    StageError : the process ended without starting a file.
    """
    waiting, alone = dict(files), dict[int, Path]()
    while waiting or alone:
        first = min(alone, default=-1)
        batch = waiting or {first: alone.pop(first)}
        single = len(batch) == 1
        process = _DecodeProcess(
            DecodeJob(_as_bytes(batch), os.fsencode(folder), settings, _THREADS)
        )
        in_progress: set[int] = set()
        with closing(process.messages()) as messages:
            for message in messages:
                if isinstance(message, Fatal):
                    raise EnvironmentLacksError(message.message, message.hint)
                if isinstance(message, Started):
                    in_progress.add(message.number)
                    continue
                in_progress.discard(message.number)
                file = batch.pop(message.number)
                if message.out_of_memory and not single:
                    alone[message.number] = file
                else:
                    yield message
        for line in process.output:
            progress.detail(f"decoder: {line}")
        if batch and not in_progress:
            raise StageError(
                "\n".join([f"the photo decoder ended ({process.end})", *process.output[-8:]])
            )
        for number in sorted(in_progress):
            file = batch.pop(number)
            if single:
                yield Done(number, reasons=(f"its decoder crashed ({process.end})",))
            else:
                alone[number] = file


def _as_bytes(files: dict[int, Path]) -> dict[int, bytes]:
    return {number: os.fsencode(file) for number, file in files.items()}


class _DecodeProcess:
    """One run of `decode_worker`."""

    def __init__(self, job: DecodeJob) -> None:
        self.job = job
        self.output: list[str] = []
        self.end = ""

    def messages(self) -> Generator[Message]:
        """Yield the messages of the process; afterwards `end` and `output` are set."""
        command = python_module("walltopo.reconstruct.ingest.decode_worker")
        message = msgspec.json.encode(self.job) + b"\n"
        with tempfile.TemporaryFile() as output:
            try:
                with child_process(
                    command, message, environment=_ENVIRONMENT, errors=output
                ) as child:
                    for line in child.output:
                        yield msgspec.json.decode(line, type=Message)
                    self.end = describe_exit(child.wait())
            finally:
                self.output = _last_output(output)


# Make malloc return large freed blocks to the system, and libraries start no threads: files are
# decoded in parallel.
_ENVIRONMENT: Final = {
    "MALLOC_MMAP_THRESHOLD_": "1048576",
    "MALLOC_TRIM_THRESHOLD_": "1048576",
    **library_threads(1),
}


def _last_output(output: IO[bytes]) -> list[str]:
    """Return the last lines that libraries printed; read at most 4000 bytes."""
    output.seek(max(0, output.seek(0, os.SEEK_END) - 4000))
    return output.read().decode("utf-8", "replace").splitlines()


class DecodeJob(msgspec.Struct, frozen=True):
    """The files that one `decode_worker` decodes.

    Parameters
    ----------
    files : maps file numbers to paths; bytes, because not all paths are UTF-8.
    folder : output folder of the JPEGs, which are named by the file's number.
    threads : number of files decoded in parallel.
    """

    files: dict[int, bytes]
    folder: bytes
    settings: IngestSettings
    threads: int


class StoredPhoto(msgspec.Struct, frozen=True):
    """A photo or video frame that was written as a JPEG.

    Parameters
    ----------
    file : name in the output folder.
    frame : number of the frame in its video; None for a photo.
    focal_px : focal length in pixels of this file; None if unknown.
    thumbnail : result of `image_file.thumbnail`, (64, 64) float32, as bytes.
    source_pixels : number of pixels of the user's picture, before it was reduced.
    source_bytes : size of the user's file; 0 for a frame of a video.
    """

    file: str
    frame: int | None
    width: int
    height: int
    focal_px: float | None
    sharpness: float
    thumbnail: bytes
    source_pixels: int = 0
    source_bytes: int = 0


class Started(msgspec.Struct, frozen=True, tag="started"):
    """Marks a file as in progress, so that a crash can be attributed to it."""

    number: int


class Done(msgspec.Struct, frozen=True, tag="done"):
    """The end of the decoding of a file.

    Parameters
    ----------
    reasons : why the file gave no photo, or not all of its frames.
    out_of_memory : memory ran out; decoding the file alone may succeed.
    """

    number: int
    photos: tuple[StoredPhoto, ...] = ()
    reasons: tuple[str, ...] = ()
    out_of_memory: bool = False


class Fatal(msgspec.Struct, frozen=True, tag="fatal"):
    """The machine lacks something, such as disk space; decoding cannot continue."""

    message: str
    hint: str


Message: TypeAlias = Started | Done | Fatal


# Ingest is limited to 1 GiB: two processes of about 65 MiB each, and this budget for pixels.
BUDGET: Final = 880 * 2**20
# Parallel files get less, because allocators keep some of the memory that each thread freed.
_PARALLEL_SHARE: Final = 640 / 880

# Bytes per pixel at a decoder's peak, if more than Pillow's image: WebP and AVIF decoders hold two
# RGBA images before Pillow copies them; a TIFF may be one single strip.
_PEAK_BYTES: Final = {"WEBP": 16.0, "AVIF": 16.0, "TIFF": 8.0}
_MODE_BYTES: Final = {"1": 1, "L": 1, "P": 1, "I;16": 2, "I;16B": 2, "I;16L": 2}
_CHROMA_PLANES: Final = {400: 1.0, 420: 1.5, 422: 2.0}
# Frames that a video decoder holds: reference frames, reordered frames and those of its threads.
_FRAMES_HELD: Final = 10


class MemoryBudget:
    """A memory budget that several threads share; a reservation waits until memory is free."""

    def __init__(self, total: int = BUDGET) -> None:
        """Prepare to decode the files of `job`."""
        self.total = total
        self._used = 0
        self._changed = threading.Condition()

    @contextmanager
    def reserve(self, size: float) -> Iterator[None]:
        """Reserve `size` bytes of memory during the block.

        Raises
        ------
        InputError : the size exceeds the whole budget; the message omits the file's name.
        """
        if size > self.total:
            raise InputError(
                f"decoding it takes {size / 2**20:,.0f} MiB of memory, more than the "
                f"{self.total / 2**20:,.0f} MiB that are allowed"
            )
        with self._changed:
            self._changed.wait_for(
                lambda: not self._used or self._used + size <= _PARALLEL_SHARE * self.total
            )
            self._used += int(size)
        try:
            yield
        finally:
            with self._changed:
                self._used -= int(size)
                self._changed.notify_all()


def bytes_to_open(opened: Image, full: tuple[int, int], factor: int, longest: int) -> float:
    """Return the peak memory, in bytes, of reducing an image to `longest` pixels.

    Parameters
    ----------
    opened : image that is not decoded yet; a JPEG may be set to decode at a reduced size.
    full : stored size, pixels.
    factor : integer factor of the reduction strip by strip after decoding.
    longest : longer side of the result, pixels.
    """
    pixels = opened.width * opened.height
    first, held = _decoder_bytes(opened, full, factor)
    made = 4.0 * pixels / factor**2
    share = min(1.0, longest * factor / max(opened.size))
    # The peaks of: decoding; strips or rotation; resizing in x and then y; JPEG, array and grey.
    resizing = made * (1 + share + share**2) if share < 1 else made
    return max(first, held + made, resizing, 3 * made * share**2) + 2**22


def _decoder_bytes(opened: Image, full: tuple[int, int], factor: int) -> tuple[float, float]:
    """Return the peak bytes during decoding, and the bytes of the decoded image."""
    pixels = opened.width * opened.height
    held = float(_MODE_BYTES.get(opened.mode, 4)) * pixels
    if opened.format == "HEIF":
        return _heif_bytes(opened, held, factor)
    if opened.format in ("JPEG", "MPO"):
        return held + _coefficient_bytes(opened, full[0] * full[1]), held
    return max(held, _PEAK_BYTES.get(opened.format or "", 0.0) * pixels), held


def _heif_bytes(opened: Image, held: float, factor: int) -> tuple[float, float]:
    """Return the bytes as `_decoder_bytes`; libheif holds the planes and the colours at once.

    A reduced image is read in place; otherwise Pillow copies the colours.
    """
    pixels = opened.width * opened.height
    deep = 2.0 if opened.info.get("bit_depth", 8) > 8 else 1.0
    planes = deep * _CHROMA_PLANES.get(opened.info.get("chroma", 444), 3.0) * pixels
    colours = float(len(opened.getbands())) * pixels
    if factor > 1:
        return planes + colours, colours
    return max(planes + colours, colours + held), held


def _coefficient_bytes(opened: Image, pixels: int) -> float:
    """Return the bytes of a progressive JPEG's coefficients, which it holds for the whole image."""
    if not opened.info.get("progressive"):
        return 0.0
    layers: list[tuple[int, int, int, int]] = getattr(opened, "layer", [])
    blocks = [across * down for _, across, down, _ in layers] or [1, 1, 1, 1]
    return 2.0 * pixels * sum(blocks) / max(*blocks, 1)


def bytes_of_frame(width: int, height: int, bits: int) -> float:
    """Return the peak memory, in bytes, of reading a video with this frame size."""
    planes = 1.5 * (2.0 if bits > 8 else 1.0)
    # The current and the best frame as RGB, and one copy of each while it is written.
    return (_FRAMES_HELD * planes + 4 * 3.0) * width * height + 2**24

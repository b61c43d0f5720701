"""How much memory decoding takes, and letting jobs in while there is room."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

from walltopo.core import InputError

if TYPE_CHECKING:
    from PIL.Image import Image


# Ingest keeps to 1 GiB: two processes of some 65 MiB each, and this for pixels.
BUDGET: Final = 880 * 2**20
# Jobs side by side get less: allocators keep a little of what each thread freed.
_SHARED: Final = 640 / 880

# Bytes a pixel while a decoder works, where that is not Pillow's own picture alone: WebP and AVIF
# come as whole files of RGBA, twice, before Pillow copies them; a TIFF may be one single strip.
_WHOLE: Final = {"WEBP": 16.0, "AVIF": 16.0, "TIFF": 8.0}
_NARROW: Final = {"1": 1, "L": 1, "P": 1, "I;16": 2, "I;16B": 2, "I;16L": 2}
_CHROMA: Final = {400: 1.0, 420: 1.5, 422: 2.0}
# Frames that a decoder of video keeps: references, those that wait for their turn, and threads'.
_FRAMES_HELD: Final = 10


class Room:
    """A budget of bytes that jobs of several threads share; a job waits until there is room."""

    def __init__(self, total: int = BUDGET) -> None:
        self.total = total
        self._used = 0
        self._changed = threading.Condition()

    @contextmanager
    def taken(self, wanted: float) -> Iterator[None]:
        """Hold `wanted` bytes over the block.

        Raises
        ------
        InputError : more than there is in all; the message is the reason alone.
        """
        if wanted > self.total:
            raise InputError(
                f"decoding it takes {wanted / 2**20:,.0f} MiB of memory, more than the "
                f"{self.total / 2**20:,.0f} MiB that are allowed"
            )
        with self._changed:
            self._changed.wait_for(
                lambda: not self._used or self._used + wanted <= _SHARED * self.total
            )
            self._used += int(wanted)
        try:
            yield
        finally:
            with self._changed:
                self._used -= int(wanted)
                self._changed.notify_all()


def bytes_to_open(opened: Image, full: tuple[int, int], factor: int, longest: int) -> float:
    """Most bytes that a picture takes on its way to at most `longest` pixels.

    Parameters
    ----------
    opened : not yet decoded; a JPEG already told to decode small.
    full : its size as stored.
    factor : by which it is reduced strip by strip after that.
    """
    pixels = opened.width * opened.height
    first, held = _decoder(opened, full, factor)
    made = 4.0 * pixels / factor**2
    share = min(1.0, longest * factor / max(opened.size))
    # Decoding; strips or turning upright; resizing, across and then down; JPEG, array and grey.
    resizing = made * (1 + share + share**2) if share < 1 else made
    return max(first, held + made, resizing, 3 * made * share**2) + 2**22


def _decoder(opened: Image, full: tuple[int, int], factor: int) -> tuple[float, float]:
    """Bytes at the peak of decoding, and bytes that its result takes."""
    pixels = opened.width * opened.height
    held = float(_NARROW.get(opened.mode, 4)) * pixels
    if opened.format == "HEIF":
        return _heif(opened, held, factor)
    if opened.format in ("JPEG", "MPO"):
        return held + _coefficients(opened, full[0] * full[1]), held
    return max(held, _WHOLE.get(opened.format or "", 0.0) * pixels), held


def _heif(opened: Image, held: float, factor: int) -> tuple[float, float]:
    """libheif holds planes and then colours; reduced, these are read in place, else copied."""
    pixels = opened.width * opened.height
    deep = 2.0 if opened.info.get("bit_depth", 8) > 8 else 1.0
    planes = deep * _CHROMA.get(opened.info.get("chroma", 444), 3.0) * pixels
    colours = float(len(opened.getbands())) * pixels
    if factor > 1:
        return planes + colours, colours
    return max(planes + colours, colours + held), held


def _coefficients(opened: Image, pixels: int) -> float:
    """Bytes of a progressive JPEG's coefficients, which are kept for the whole picture."""
    if not opened.info.get("progressive"):
        return 0.0
    layers: list[tuple[int, int, int, int]] = getattr(opened, "layer", [])
    blocks = [across * down for _, across, down, _ in layers] or [1, 1, 1, 1]
    return 2.0 * pixels * sum(blocks) / max(*blocks, 1)


def bytes_of_frame(width: int, height: int, bits: int) -> float:
    """Most bytes that reading a video of this frame size takes."""
    planes = 1.5 * (2.0 if bits > 8 else 1.0)
    # The frame at hand and the best so far as RGB, and their copies on the way to a file.
    return (_FRAMES_HELD * planes + 4 * 3.0) * width * height + 2**24

"""Convert COCO's segmentations, outlines and run lengths, to masks and back.

COCO's run lengths scan a picture column by column, with runs of 0 and 1 in turn, 0 first. Masks are
built from runs without drawing the whole picture, and every number of a file is checked against
the picture's size before use.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from walltopo.core import InputError, Mask
from walltopo.core.view import check_picture_size
from walltopo.scans.document import Count, Side, parse

Ints = NDArray[np.int64]
Outline = Sequence[float] | NDArray[np.float64]  # x, y, x, y, ...
# Drawing an outline needs about 100 bytes per pixel of its length; a hold's has a few thousand.
MAX_OUTLINE = 4_000_000


class Rle(msgspec.Struct, frozen=True):
    """Run lengths: `size` is (height, width), `counts` plain or in COCO's text form."""

    size: tuple[Side, Side]
    counts: str | tuple[Count, ...]


# Outlines x, y, x, y, ... in pixels, or run lengths.
Segmentation = tuple[tuple[float, ...], ...] | Rle


class _Shape(msgspec.Struct, frozen=True):
    segmentation: Segmentation


def parse_segmentation(value: Any, where: str) -> Segmentation:
    """Return a checked segmentation from plain JSON; an InputError begins with `where`."""
    return parse({"segmentation": value}, _Shape, where).segmentation


def encode_mask(mask: Mask) -> dict[str, Any]:
    """Return COCO's compressed RLE (JSON-able) of a mask at its full image size."""
    from faster_coco_eval.core import mask as rle

    encoded = rle.encode(np.asfortranarray(mask.full(), dtype=np.uint8))
    height, width = encoded["size"]
    return {"size": [int(height), int(width)], "counts": encoded["counts"].decode("ascii")}


def decode_segmentation(
    segmentation: Segmentation, width: int, height: int, label: int, score: float
) -> Mask:
    """Return a mask from COCO's outlines, plain run lengths or compressed run lengths.

    Outlines of fewer than three points are ignored. Run lengths include the size of their mask,
    which may differ from the picture's; see `Mask`.

    Raises
    ------
    InputError : the run lengths do not fill their picture; or see `check_outlines`.
    """
    if isinstance(segmentation, Rle):
        height, width = segmentation.size
        check_picture_size(width, height)
        ones = _runs_of_ones(_run_lengths(segmentation.counts), width * height)
    else:
        ones = _draw_outlines(check_outlines(segmentation, width, height), width, height)
    return _mask_of_runs(ones, width, height, label, score)


def check_outlines(outlines: Sequence[Outline], width: int, height: int) -> list[Outline]:
    """Return the outlines with at least three points.

    Raises
    ------
    InputError : an outline has an odd number of coordinates, or a point that is not finite or is
        farther outside the picture than the picture is large; or the outlines are too long.
    """
    kept: list[Outline] = []
    length = 0.0
    size = np.array([width, height], dtype=np.float64)
    for number, outline in enumerate(outlines):
        if len(outline) % 2:
            raise InputError(f"outline {number} has {len(outline)} coordinates, an odd number")
        points = np.asarray(outline, dtype=np.float64).reshape(-1, 2)
        if not ((points >= -size) & (points <= 2 * size)).all():
            raise InputError(
                f"outline {number} has a point far outside the picture of {width}x{height}"
            )
        if len(points) >= 3:
            kept.append(outline)
            length += float(np.abs(points - np.roll(points, 1, axis=0)).max(axis=1).sum())
    if length > MAX_OUTLINE:
        raise InputError(f"outlines of {length:.0f} pixels are too long for an object")
    return kept


def _run_lengths(counts: str | tuple[int, ...]) -> Ints:
    """Return the (n,) run lengths."""
    if not isinstance(counts, str):
        return np.asarray(counts, dtype=np.int64)
    # COCO's text has five bits per letter, and a sixth that means "continued". The highest bit of
    # the last letter is the sign. From the fourth number on, the number two before is subtracted.
    try:
        letters = np.frombuffer(counts.encode("ascii"), dtype=np.uint8).astype(np.int64) - 48
    except UnicodeEncodeError as error:
        raise InputError("RLE text with letters that COCO does not use") from error
    if len(letters) == 0:
        return letters
    last = (letters & 32) == 0
    if letters.min() < 0 or letters.max() > 63 or not last[-1]:
        raise InputError("RLE text that is cut or has letters that COCO does not use")
    ends = np.flatnonzero(last)
    starts = np.concatenate([[0], ends[:-1] + 1])
    lengths = ends - starts + 1
    if lengths.max() > 8:
        raise InputError("RLE text with a number beyond any picture")
    place = np.arange(len(letters)) - np.repeat(starts, lengths)
    numbers = np.add.reduceat((letters & 31) << 5 * place, starts)
    numbers -= np.where(letters[ends] & 16, 1 << 5 * lengths, 0)
    for first in (1, 2):
        numbers[first::2] = np.cumsum(numbers[first::2])
    return numbers


def _runs_of_ones(counts: Ints, pixels: int) -> Ints:
    """Return (n, 2) first pixel of each run of ones and the one after its last."""
    ends = np.cumsum(counts)
    # With all counts within the picture, their sums cannot overflow to a wrong end.
    if len(counts) and (counts.min() < 0 or counts.max() > pixels):
        raise InputError(f"RLE with a run of {counts.min()} or {counts.max()} pixels")
    if len(counts) and int(ends[-1]) != pixels:
        raise InputError(f"RLE of {int(ends[-1])} pixels in a picture of {pixels}")
    ends = ends[: len(ends) // 2 * 2].reshape(-1, 2)
    return ends[ends[:, 1] > ends[:, 0]]


def _draw_outlines(outlines: Sequence[Outline], width: int, height: int) -> Ints:
    """Return the runs of the union of all outlines, drawn by COCO's rule."""
    if not outlines:
        return np.zeros((0, 2), dtype=np.int64)
    from faster_coco_eval.core import mask as rle

    parts = rle.frPyObjects([list(outline) for outline in outlines], height, width)
    runs = np.concatenate(
        [
            _runs_of_ones(_run_lengths(part["counts"].decode("ascii")), width * height)
            for part in parts
        ]
    )
    if len(outlines) == 1 or not len(runs):
        return runs
    # One sweep over all starts and stops instead of pairwise merging.
    at = runs.T.ravel()
    order = np.argsort(at, kind="stable")  # starts before stops at the same pixel
    depth = np.cumsum(np.repeat([1, -1], len(runs))[order])
    starts = np.flatnonzero((depth == 1) & (np.concatenate([[0], depth[:-1]]) == 0))
    stops = np.flatnonzero(depth == 0)
    return np.stack([at[order][starts], at[order][stops]], axis=1)


def _mask_of_runs(ones: Ints, width: int, height: int, label: int, score: float) -> Mask:
    if not len(ones):
        return Mask(np.zeros((0, 0), dtype=np.bool_), 0, 0, width, height, label, score)
    left, right = int(ones[0, 0]) // height, (int(ones[-1, 1]) - 1) // height + 1
    first, last = ones[:, 0], ones[:, 1] - 1
    top, bottom = 0, height
    if (first // height == last // height).all():  # no run continues in the next column
        top, bottom = int((first % height).min()), int((last % height).max()) + 1
    edges = np.concatenate([[left * height], ones.ravel(), [right * height]])
    lengths = np.diff(edges)
    stripe = np.repeat(np.arange(len(lengths)) % 2 == 1, lengths).reshape(right - left, height)
    bitmap = np.ascontiguousarray(stripe[:, top:bottom].T)
    return Mask(bitmap, left, top, width, height, label, score)

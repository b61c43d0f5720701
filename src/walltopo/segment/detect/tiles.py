"""Overlapping tiles of large photos, batches limited by memory, and fusion of two passes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from walltopo.core import Mask
from walltopo.core.memory import free_memory
from walltopo.segment.detect.photo_detections import PhotoDetections, box_iou

_SEAM_PX = 3.0  # a box that ends this close to an inner tile border was cut by it
_SAME = 0.5  # overlap above which two detections are one object: IoU, or share of the smaller mask


@dataclass(frozen=True)
class Tile:
    """A rectangle of the photo: x0, y0, x1, y1 in pixels, end exclusive."""

    x0: int
    y0: int
    x1: int
    y1: int


def _starts(length: int, tile: int, overlap: int) -> list[int]:
    if length <= tile:
        return [0]
    count = int(np.ceil((length - overlap) / (tile - overlap)))
    return [round(k * (length - tile) / (count - 1)) for k in range(count)]


def tiles_of(width: int, height: int, tile: int, overlap: int) -> list[Tile]:
    """Return tiles of at most `tile` px that cover the photo; neighbours share >= `overlap` px."""
    overlap = min(overlap, tile // 2)
    return [
        Tile(x, y, min(x + tile, width), min(y + tile, height))
        for y in _starts(height, tile, overlap)
        for x in _starts(width, tile, overlap)
    ]


def _is_cut(box: NDArray[np.float64], tile: Tile, width: int, height: int) -> bool:
    return bool(
        (tile.x0 > 0 and box[0] <= tile.x0 + _SEAM_PX)
        or (tile.y0 > 0 and box[1] <= tile.y0 + _SEAM_PX)
        or (tile.x1 < width and box[2] >= tile.x1 - _SEAM_PX)
        or (tile.y1 < height and box[3] >= tile.y1 - _SEAM_PX)
    )


def _shifted(mask: Mask, tile: Tile, width: int, height: int) -> Mask:
    return replace(mask, x=mask.x + tile.x0, y=mask.y + tile.y0, width=width, height=height)


def _union(a: Mask, b: Mask) -> Mask:
    x0, y0 = min(a.x, b.x), min(a.y, b.y)
    x1 = max(a.x + a.bitmap.shape[1], b.x + b.bitmap.shape[1])
    y1 = max(a.y + a.bitmap.shape[0], b.y + b.bitmap.shape[0])
    bitmap = np.zeros((y1 - y0, x1 - x0), np.bool_)
    for m in (a, b):
        h, w = m.bitmap.shape
        bitmap[m.y - y0 : m.y - y0 + h, m.x - x0 : m.x - x0 + w] |= m.bitmap
    return replace(a, bitmap=bitmap, x=x0, y=y0, score=max(a.score, b.score))


def _mask_window(mask: Mask, x0: int, y0: int, x1: int, y1: int) -> NDArray[np.bool_]:
    """Return the mask within a rectangle of the photo, as a bitmap of the rectangle's size."""
    out = np.zeros((max(0, y1 - y0), max(0, x1 - x0)), np.bool_)
    h, w = mask.bitmap.shape
    u0, u1 = max(x0, mask.x), min(x1, mask.x + w)
    v0, v1 = max(y0, mask.y), min(y1, mask.y + h)
    if u1 > u0 and v1 > v0:
        out[v0 - y0 : v1 - y0, u0 - x0 : u1 - x0] = mask.bitmap[
            v0 - mask.y : v1 - mask.y, u0 - mask.x : u1 - mask.x
        ]
    return out


def _same_object(
    a: Mask | None,
    b: Mask | None,
    box_a: NDArray[np.float64],
    box_b: NDArray[np.float64],
    tile_a: Tile,
    tile_b: Tile,
) -> bool:
    """Return whether two detections agree within the strip that both tiles contain."""
    x0, y0 = max(tile_a.x0, tile_b.x0), max(tile_a.y0, tile_b.y0)
    x1, y1 = min(tile_a.x1, tile_b.x1), min(tile_a.y1, tile_b.y1)
    if x1 <= x0 or y1 <= y0:
        return False
    if a is None or b is None:
        strip = np.array([x0, y0, x1, y1], dtype=np.float64)
        clip_a = np.concatenate(
            [np.maximum(box_a[:2], strip[:2]), np.minimum(box_a[2:], strip[2:])]
        )
        clip_b = np.concatenate(
            [np.maximum(box_b[:2], strip[:2]), np.minimum(box_b[2:], strip[2:])]
        )
        return bool(box_iou(clip_a[None], clip_b[None])[0, 0] > _SAME)
    in_a, in_b = _mask_window(a, x0, y0, x1, y1), _mask_window(b, x0, y0, x1, y1)
    smaller = min(np.count_nonzero(in_a), np.count_nonzero(in_b))
    return bool(smaller > 0 and np.count_nonzero(in_a & in_b) > _SAME * smaller)


@dataclass
class _Found:
    """A detection of a tile, in pixels of the whole photo; `cut`: the tile's border cuts it."""

    box: NDArray[np.float64]
    score: float
    label: int
    cut: bool
    tile: Tile
    mask: Mask | None

    def shows(self, other: _Found) -> bool:
        """Return whether both are the same object, seen from two tiles."""
        if self.label != other.label or self.tile == other.tile:
            return False
        a, b = self.box, other.box
        if a[0] > b[2] or b[0] > a[2] or a[1] > b[3] or b[1] > a[3]:
            return False
        return _same_object(self.mask, other.mask, a, b, self.tile, other.tile)

    def join(self, other: _Found) -> None:
        """Take the better score; if both are cut, also the union of box and mask."""
        self.score = max(self.score, other.score)
        if not (self.cut and other.cut):
            return
        a, b = self.box, other.box
        self.box = np.concatenate([np.minimum(a[:2], b[:2]), np.maximum(a[2:], b[2:])])
        if self.mask is not None and other.mask is not None:
            self.mask = _union(self.mask, other.mask)


def _found_in(tile: Tile, part: PhotoDetections, width: int, height: int) -> Iterator[_Found]:
    for k in range(len(part)):
        box = part.boxes[k] + [tile.x0, tile.y0, tile.x0, tile.y0]
        mask = _shifted(part.masks[k], tile, width, height) if part.masks else None
        cut = _is_cut(box, tile, width, height)
        yield _Found(box, float(part.scores[k]), int(part.labels[k]), cut, tile, mask)


def merge_tiles(
    parts: Sequence[tuple[Tile, PhotoDetections]], width: int, height: int
) -> PhotoDetections:
    """Return the detections of the whole photo from those of its tiles.

    Whole objects win over cut ones. Two cut parts that agree in the strip that both tiles contain
    are joined.
    """
    found = [one for tile, part in parts for one in _found_in(tile, part, width, height)]
    chosen: list[_Found] = []
    for one in sorted(found, key=lambda one: (one.cut, -one.score)):
        same = next((other for other in chosen if other.shows(one)), None)
        if same is None:
            chosen.append(one)
        else:
            same.join(one)
    chosen.sort(key=lambda one: -one.score)
    return PhotoDetections(
        width,
        height,
        np.array([one.box for one in chosen], dtype=np.float64).reshape(-1, 4),
        np.array([one.score for one in chosen], dtype=np.float64),
        np.array([one.label for one in chosen], dtype=np.int64),
        tuple(one.mask for one in chosen if one.mask is not None),
    )


_BYTES_PER_PIXEL = 160  # of input, outputs included; 100 measured for the shipped network
_MEMORY_SHARE = 0.5  # of free memory
_MAX_BATCH = 16

Arrays = list[NDArray[np.float32]]


def in_batches(
    inputs: Sequence[NDArray[np.generic]], max_batch: int, free: int
) -> Iterator[list[int]]:
    """Yield the positions of inputs that form a batch: consecutive inputs of one shape.

    Parameters
    ----------
    inputs : arrays without the batch axis.
    max_batch : largest batch; 0 means as many as fit into half of `free` bytes.
    """
    batch: list[int] = []
    for k, values in enumerate(inputs):
        need = _BYTES_PER_PIXEL * values.size / 3
        limit = max(1, max_batch or min(int(_MEMORY_SHARE * free / need), _MAX_BATCH))
        if batch and (values.shape != inputs[batch[0]].shape or len(batch) >= limit):
            yield batch
            batch = []
        batch.append(k)
    if batch:
        yield batch


def run_batched(
    run: Callable[[NDArray[np.generic]], Arrays],
    inputs: Sequence[NDArray[np.generic]],
    max_batch: int,
) -> list[Arrays]:
    """Return the outputs of each input; halve a batch that does not fit into GPU memory.

    Parameters
    ----------
    run : maps (n, ...) inputs to outputs with n first.
    """
    outputs: list[Arrays] = []
    waiting = list(in_batches(inputs, max_batch, free_memory()))
    while waiting:
        batch = waiting.pop(0)
        try:
            results = run(np.stack([inputs[k] for k in batch]))
        except Exception as error:  # ONNX Runtime has no exception type for lack of memory
            if len(batch) == 1 or "alloc" not in str(error).lower():
                raise
            half = len(batch) // 2
            waiting[:0] = [batch[:half], batch[half:]]
            continue
        outputs += [[part[k] for part in results] for k in range(len(batch))]
    return outputs


def mirrored(found: PhotoDetections) -> PhotoDetections:
    """Return the detections in the photo mirrored left to right."""
    boxes = found.boxes[:, [2, 1, 0, 3]].copy()
    boxes[:, [0, 2]] = found.width - boxes[:, [0, 2]]
    masks = tuple(
        replace(m, bitmap=m.bitmap[:, ::-1], x=m.width - m.x - m.bitmap.shape[1])
        for m in found.masks
    )
    return replace(found, boxes=boxes, masks=masks)


def _group_boxes(
    passes: Sequence[PhotoDetections], boxes: NDArray[np.float64]
) -> list[NDArray[np.int64]]:
    """Return the rows of `boxes` that show the same object, for each object; best score first.

    Parameters
    ----------
    boxes : of all passes, one pass after the other.
    """
    scores = np.concatenate([found.scores for found in passes])
    labels = np.concatenate([found.labels for found in passes])
    source = np.repeat(np.arange(len(passes)), [len(found) for found in passes])
    overlap = box_iou(boxes, boxes)
    free = np.ones(len(boxes), np.bool_)
    groups = []
    for first in np.argsort(-scores, kind="stable"):
        if not free[first]:
            continue
        free[first] = False
        group = [int(first)]
        for other in range(len(passes)):
            if other == source[first]:
                continue
            same = free & (source == other) & (labels == labels[first])
            near = np.flatnonzero(same & (overlap[first] > _SAME))
            if len(near):
                group.append(int(near[overlap[first, near].argmax()]))
                free[group[-1]] = False
        groups.append(np.array(group))
    return groups


def fuse(passes: Sequence[PhotoDetections]) -> PhotoDetections:
    """Return the fused detections of several passes over one photo, highest score first.

    Weighted boxes fusion (Solovyev, Wang, Gabruseva, Image and Vision Computing 2021). An object's
    box is the mean of its boxes, weighted by score. Its score is the mean over all passes, with 0
    for a pass that misses it. Its mask is the one with the highest score.
    """
    if len(passes) == 1:
        return passes[0]
    boxes = np.concatenate([found.boxes for found in passes])
    scores = np.concatenate([found.scores for found in passes])
    labels = np.concatenate([found.labels for found in passes])
    masks = [mask for found in passes for mask in found.masks]
    groups = _group_boxes(passes, boxes)
    fused = np.array([scores[group].sum() / len(passes) for group in groups])
    order = np.argsort(-fused, kind="stable")
    means = [np.average(boxes[groups[k]], axis=0, weights=scores[groups[k]]) for k in order]
    kept: list[Mask] = []
    if masks:
        kept = [replace(masks[groups[k][0]], score=float(fused[k])) for k in order]
    return PhotoDetections(
        passes[0].width,
        passes[0].height,
        np.array(means).reshape(-1, 4),
        fused[order],
        np.array([labels[groups[k][0]] for k in order], dtype=np.int64),
        tuple(kept),
    )

"""Store depth maps on disk, merge stereo pairs and check depths across photos."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.geometry.kernels import in_ranges, kernel

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DepthMap:
    """The depths of one photo with their weights.

    Parameters
    ----------
    depth : (H, W) float32 z-depth in the view's camera frame, 0 = unknown.
    weight : (H, W) float32, inverse variance times edge squared, 0 where no depth.
    pairs : (H, W) uint8, stereo pairs that agree on the depth.
    view : the pinhole view of all three.
    """

    depth: NDArray[np.float32]
    weight: NDArray[np.float32]
    pairs: NDArray[np.uint8]
    view: View


def intrinsics(view: View) -> Floats:
    """Return fx, fy, cx, cy (4,) of a pinhole view, in pixels."""
    camera = view.camera
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


@kernel
def reproject(
    x: int, y: int, z: float, here: Floats, there: Floats, there_from_here: Floats
) -> tuple[float, float, float]:
    """Project a pixel with known depth into another photo.

    Parameters
    ----------
    x, y : pixel indices; the point lies at the pixel's centre.
    z : z-depth in this photo's camera frame.
    here, there : (4,) intrinsics of this and the other photo.
    there_from_here : (3, 4) transform from this camera frame to the other.

    Returns
    -------
    u, v : pixels in the other photo; NaN if the point lies behind its camera.
    depth : z-depth in the other photo; <= 0 if the point lies behind its camera.
    """
    px = (x + 0.5 - here[2]) / here[0] * z
    py = (y + 0.5 - here[3]) / here[1] * z
    m = there_from_here
    depth = m[2, 0] * px + m[2, 1] * py + m[2, 2] * z + m[2, 3]
    if depth <= 0.0:
        return np.nan, np.nan, depth
    u = (m[0, 0] * px + m[0, 1] * py + m[0, 2] * z + m[0, 3]) / depth * there[0] + there[2]
    v = (m[1, 0] * px + m[1, 1] * py + m[1, 2] * z + m[1, 3]) / depth * there[1] + there[3]
    return u, v, depth


_Extent = tuple[int, tuple[int, ...], Any]  # byte offset in the file, shape, dtype


class DepthMapStore(Sequence[DepthMap]):
    """A sequence of depth maps backed by a temporary file that is deleted with this object.

    An item is memory-mapped: the system loads its pages on demand and may drop them again. Writes
    to its arrays are private copies and do not reach the file.
    """

    def __init__(self, maps: Iterable[DepthMap] = (), folder: Path | None = None) -> None:
        """Store maps in a file in `folder`, by default the system's temporary folder."""
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - closed with the store
        self._rows: list[tuple[View, list[_Extent]]] = []
        for item in maps:
            self.append(item)

    def append(self, item: DepthMap) -> None:
        self._rows.append(
            (item.view, [self._write(a) for a in (item.depth, item.weight, item.pairs)])
        )

    def __len__(self) -> int:
        return len(self._rows)

    @overload
    def __getitem__(self, k: int) -> DepthMap: ...

    @overload
    def __getitem__(self, k: slice) -> list[DepthMap]: ...

    def __getitem__(self, k: int | slice) -> DepthMap | list[DepthMap]:
        if isinstance(k, slice):
            return [self[j] for j in range(*k.indices(len(self)))]
        view, extents = self._rows[k]
        depth, weight, pairs = (self._map(*extent) for extent in extents)
        return DepthMap(depth, weight, pairs, view)

    def _write(self, values: NDArray[Any]) -> _Extent:
        end = self._file.seek(0, 2)
        begin = self._file.seek(-(-end // mmap.ALLOCATIONGRANULARITY) * mmap.ALLOCATIONGRANULARITY)
        self._file.write(np.ascontiguousarray(values).data)
        self._file.flush()
        return begin, values.shape, values.dtype

    def _map(self, begin: int, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
        length = int(np.prod(shape)) * np.dtype(kind).itemsize
        pages = mmap.mmap(self._file.fileno(), length, access=mmap.ACCESS_COPY, offset=begin)
        return np.frombuffer(pages, kind).reshape(shape)


Depth = NDArray[np.float32]

# Standard deviation of a correct disparity, pixels.
_DISPARITY_SIGMA = 0.5

# Depths agree when they differ by less than this many joint standard deviations.
_TOLERANCE = 3.0

# Number of maps that must agree within the tolerance, if that many can see the point.
_MIN_AGREEING = 2

# Matches this close to the partner's border are unreliable, pixels: the matching windows, at
# half size, reach across the border.
_BORDER_MARGIN = 16.0


@kernel
def _merge_rows(
    begin: int,
    end: int,
    stack: Depth,
    precision: Floats,
    view_intrinsics: Floats,
    partner_intrinsics: Floats,
    sizes: Floats,
    transforms: Floats,
    agree: int,
    depth: Depth,
    weight: Depth,
    support: NDArray[np.uint8],
) -> None:
    """Fill the rows begin .. end of depth, weight and support in place."""
    pairs, _, width = stack.shape
    tolerance = np.zeros((pairs, pairs))
    for one in range(pairs):
        for k in range(pairs):
            joint = np.sqrt(1.0 / precision[one] + 1.0 / precision[k])
            tolerance[one, k] = _TOLERANCE * joint
    for y in range(begin, end):
        for x in range(width):
            best = 0.0
            for candidate in range(pairs):
                z = stack[candidate, y, x]
                if np.isnan(z):
                    continue
                votes, against = 0, 0
                summed, total = 0.0, 0.0
                for k in range(pairs):
                    found = stack[k, y, x]
                    if np.isnan(found):
                        continue
                    if abs(found - z) < tolerance[candidate, k] * z * z:
                        votes += 1
                        summed += precision[k]
                        total += precision[k] * found
                    else:
                        u, v, _ = reproject(
                            x, y, z, view_intrinsics, partner_intrinsics[k], transforms[k]
                        )
                        right, bottom = sizes[k, 0] - _BORDER_MARGIN, sizes[k, 1] - _BORDER_MARGIN
                        if _BORDER_MARGIN <= u < right and _BORDER_MARGIN <= v < bottom:
                            against += 1
                if votes >= max(1, min(agree, votes + against)) and summed > best:
                    best = summed
                    depth[y, x] = total / summed
                    support[y, x] = votes
            if best > 0.0:
                weight[y, x] = best / depth[y, x] ** 4


def merge_pair_depths(
    maps: Sequence[Depth], view: View, partners: Sequence[View]
) -> tuple[Depth, Depth, NDArray[np.uint8]]:
    """Merge depth maps of one photo, one per stereo pair, into the depth with the most support.

    A pair has no vote at points that its partner does not see. So the strip along a partner's
    border keeps the depth that the other pairs found.

    Parameters
    ----------
    maps : one (H, W) float32 z-depth map per stereo pair, NaN where unknown.
    view : the photo's pinhole view.
    partners : pinhole view of each pair's other photo; a longer baseline is more precise.

    Returns
    -------
    depth : (H, W) float32, 0 where too few pairs agree.
    weight : (H, W) float32, inverse variance in 1 / world units squared, 0 where no depth.
    support : (H, W) uint8, number of maps that agree on the depth, 0 where no depth.
    """
    here = np.eye(4)
    here[:3] = view.cam_from_world
    back = np.linalg.inv(here)
    baselines = np.array([np.linalg.norm(other.centre - view.centre) for other in partners])
    stack = np.stack(maps)
    depth, weight = np.zeros(stack.shape[1:], np.float32), np.zeros(stack.shape[1:], np.float32)
    support = np.zeros(stack.shape[1:], dtype=np.uint8)
    in_ranges(
        _merge_rows,
        len(depth),
        stack,
        (view.camera.fx * baselines / _DISPARITY_SIGMA) ** 2,
        intrinsics(view),
        np.stack([intrinsics(other) for other in partners]),
        np.array([[other.camera.width, other.camera.height] for other in partners], dtype=float),
        np.stack([other.cam_from_world @ back for other in partners]),
        _MIN_AGREEING,
        depth,
        weight,
        support,
    )
    return depth, weight, support


@kernel
def _vote(
    begin: int,
    end: int,
    depth: Depth,
    weight: Depth,
    other: Depth,
    other_weight: Depth,
    k_here: Floats,
    k_there: Floats,
    there_from_here: Floats,
    sigma: float,
    votes: NDArray[np.int8],
) -> None:
    """Add 1 to pixels that the other map confirms; subtract 1 where it sees through them."""
    width = depth.shape[1]
    rows, columns = other.shape
    for y in range(begin, end):
        for x in range(width):
            z = depth[y, x]
            if z <= 0.0:
                continue
            right, down, qz = reproject(x, y, z, k_here, k_there, there_from_here)
            if qz <= 0.0:
                continue
            u, v = int(np.floor(right)), int(np.floor(down))
            if u < 0 or v < 0 or u >= columns or v >= rows:
                continue
            found = other[v, u]
            if found <= 0.0:
                continue
            tolerance = _TOLERANCE * sigma * np.sqrt(1.0 / weight[y, x] + 1.0 / other_weight[v, u])
            if abs(found - qz) < tolerance:
                votes[y, x] += 1
            elif found > qz + tolerance:
                votes[y, x] -= 1


def keep_confirmed(
    index: int, maps: Sequence[DepthMap], partners: Sequence[int], sigma: float, min_pairs: int
) -> DepthMap:
    """Return a depth map without the pixels that other maps contradict or fail to confirm.

    Each other map votes +1 for a pixel if it holds the same surface there, and -1 if it sees
    through it. A pixel needs one vote, or zero if enough of its own stereo pairs agree.

    Parameters
    ----------
    index : index in `maps` of the depth map to check.
    maps : depth maps of all photos.
    partners : indices of the maps that vote.
    sigma : standard deviation of a depth of weight 1, world units.
    min_pairs : number of own stereo pairs from which a sum of zero votes is enough; 0: always.
    """
    own = maps[index]
    here = np.eye(4)
    here[:3] = own.view.cam_from_world
    back = np.linalg.inv(here)
    votes = np.zeros(own.depth.shape, dtype=np.int8)
    for j in partners:
        other = maps[j]
        in_ranges(
            _vote,
            len(votes),
            own.depth,
            own.weight,
            other.depth,
            other.weight,
            intrinsics(own.view),
            intrinsics(other.view),
            np.ascontiguousarray(other.view.cam_from_world @ back),
            sigma,
            votes,
        )
    keep = votes >= np.where(own.pairs >= min_pairs, 0, 1)
    return replace(own, depth=np.where(keep, own.depth, 0.0).astype(np.float32))

"""Depth maps of photos, kept on disk."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.geometry.kernels import kernel

Floats = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class DepthMap:
    """Depths of one photo and how far to trust them.

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
    """(4,) fx, fy, cx, cy of a pinhole view, pixels."""
    camera = view.camera
    return np.array([camera.fx, camera.fy, camera.cx, camera.cy])


@kernel
def seen_from(
    x: int, y: int, z: float, here: Floats, there: Floats, there_from_here: Floats
) -> tuple[float, float, float]:
    """Where another photo sees what lies at a depth in a pixel of this one.

    Parameters
    ----------
    x, y : the pixel; its middle is meant.
    z : z-depth in this photo's camera frame.
    here, there : (4,) intrinsics of both.
    there_from_here : (3, 4) between the camera frames.

    Returns
    -------
    u, v : pixels in the other photo; nan where it looks away.
    depth : z-depth there; not above 0 where it looks away.
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


_Place = tuple[int, tuple[int, ...], Any]  # byte in the file, shape, dtype


class Shelf(Sequence[DepthMap]):
    """Depth maps in a file that is gone with this object.

    A map that is taken is the file's pages, which the system reads as they are looked at and may
    drop again; what is written to its arrays stays with them.
    """

    def __init__(self, maps: Iterable[DepthMap] = (), folder: Path | None = None) -> None:
        """Keep maps in a file of `folder`; without one where temporary files are."""
        self._file = tempfile.TemporaryFile(dir=folder)  # noqa: SIM115 - as long as the shelf
        self._rows: list[tuple[View, list[_Place]]] = []
        for item in maps:
            self.append(item)

    def append(self, item: DepthMap) -> None:
        self._rows.append(
            (item.view, [self._put(a) for a in (item.depth, item.weight, item.pairs)])
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
        view, places = self._rows[k]
        depth, weight, pairs = (self._take(*place) for place in places)
        return DepthMap(depth, weight, pairs, view)

    def _put(self, values: NDArray[Any]) -> _Place:
        end = self._file.seek(0, 2)
        begin = self._file.seek(-(-end // mmap.ALLOCATIONGRANULARITY) * mmap.ALLOCATIONGRANULARITY)
        self._file.write(np.ascontiguousarray(values).data)
        self._file.flush()
        return begin, values.shape, values.dtype

    def _take(self, begin: int, shape: tuple[int, ...], kind: Any) -> NDArray[Any]:
        length = int(np.prod(shape)) * np.dtype(kind).itemsize
        pages = mmap.mmap(self._file.fileno(), length, access=mmap.ACCESS_COPY, offset=begin)
        return np.frombuffer(pages, kind).reshape(shape)

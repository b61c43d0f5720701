"""Depth maps on disk: a hall has more of them than memory, and each is looked at a few times."""

from __future__ import annotations

import mmap
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import NDArray

from walltopo.core import View
from walltopo.dense.depth import DepthMap

__all__ = ["Shelf"]

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

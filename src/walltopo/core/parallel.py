"""Count processors, work in threads of this process, and limit the threads of libraries."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def map_ahead(
    work: Callable[[Item], Result],
    items: Iterable[Item],
    threads: int | None = None,
    buffered: int | None = None,
) -> Iterator[Result]:
    """Yield `work(item)` of each item in order, computed ahead in threads.

    An exception of `work` is raised when its item's turn comes.

    Parameters
    ----------
    threads : default: as many as there are cores. One takes the items in their order.
    buffered : maximum number of results that wait, so that memory is bounded; default: `threads`.
    """
    count = threads or available_cores()
    limit = buffered or count
    with ThreadPoolExecutor(count) as pool:
        futures: deque[Future[Result]] = deque()
        try:
            for item in items:
                if len(futures) >= limit:
                    yield futures.popleft().result()
                futures.append(pool.submit(work, item))
            while futures:
                yield futures.popleft().result()
        finally:
            for future in futures:
                future.cancel()


def available_cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1  # noqa: TID251


def library_threads(threads: int, blas: int | None = None) -> dict[str, str]:
    """Return the variables of a child process that limit its libraries' threads.

    They count for OpenMP (COLMAP), Numba, OpenCV and OpenBLAS.

    Parameters
    ----------
    threads : threads of each library; 0 or less: their default.
    blas : threads of OpenBLAS, if not as many. Its last bits depend on their number.
    """
    names = ("OMP_NUM_THREADS", "NUMBA_NUM_THREADS", "OPENCV_FOR_THREADS_NUM")
    limits = dict.fromkeys(names, threads) | {"OPENBLAS_NUM_THREADS": blas or threads}
    return {name: str(limit) for name, limit in limits.items() if limit > 0}

"""Process independent items in threads of this process."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from typing import TypeVar

Item = TypeVar("Item")
Result = TypeVar("Result")


def ahead(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield `work(item)` of each item in order, computed in as many threads as there are cores.

    At most that many results are buffered, so memory is bounded. An exception of `work` is raised
    when its item's turn comes.
    """
    with ThreadPoolExecutor(cores()) as pool:
        futures: deque[Future[Result]] = deque()
        try:
            for item in items:
                if len(futures) >= cores():
                    yield futures.popleft().result()
                futures.append(pool.submit(work, item))
            while futures:
                yield futures.popleft().result()
        finally:
            for future in futures:
                future.cancel()


def cores() -> int:
    """Return the number of processors that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1  # noqa: TID251

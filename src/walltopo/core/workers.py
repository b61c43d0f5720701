"""Work on many independent items: in this process, in threads, or on a cluster.

A stage declares what all items share (`prepare`, called once in each worker process) and what is
done with each item (`work`). Results come in the order of the items, so a stage cannot tell where
they were made.
"""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import Protocol, TypeVar

Shared = TypeVar("Shared")

Item = TypeVar("Item")

Result = TypeVar("Result")


class Workers(Protocol):
    """Who computes for a stage."""

    @property
    def threads(self) -> int:
        """Threads that the work on one item may use; 0 = all of the machine's."""

    def within(self, scratch: Path) -> Workers:
        """The same, with an empty folder for what passes between processes."""

    def map(
        self,
        prepare: Callable[[], Shared],
        work: Callable[[Shared, Item], Result],
        items: Sequence[Item],
        *,
        threaded: bool = False,
    ) -> Iterator[Result]:
        """The result of each item, in their order.

        Parameters
        ----------
        prepare : makes what all items share: opens a model, holds the cameras.
        work : gets that and an item. Both may be carried to another process, so they name files
            by path and hold no pictures.
        threaded : `work` takes one thread and may be called from several at once.

        Raises
        ------
        Whatever `prepare` and `work` raise, at the item where they did.
        """


class Here:
    """This process: one item after the other, or where `work` allows, one a core."""

    threads = 0

    def within(self, scratch: Path) -> Here:
        """Nothing passes between processes."""
        return self

    def map(
        self,
        prepare: Callable[[], Shared],
        work: Callable[[Shared, Item], Result],
        items: Sequence[Item],
        *,
        threaded: bool = False,
    ) -> Iterator[Result]:
        """See `Workers.map`."""
        shared = prepare()
        if threaded:
            yield from ahead(lambda item: work(shared, item), items)
            return
        for item in items:
            yield work(shared, item)


def ahead(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """`work(item)` of each item, in their order; as many at a time as there are cores.

    No more results wait than that, so that memory stays bounded. What `work` raises is raised at
    its item's turn.
    """
    with ThreadPoolExecutor(cores()) as pool:
        waiting: deque[Future[Result]] = deque()
        try:
            for item in items:
                if len(waiting) >= cores():
                    yield waiting.popleft().result()
                waiting.append(pool.submit(work, item))
            while waiting:
                yield waiting.popleft().result()
        finally:
            for left in waiting:
                left.cancel()


def cores() -> int:
    """How many processors this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1

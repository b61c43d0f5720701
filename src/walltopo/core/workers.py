"""Work on many items that do not need each other: here one after the other, elsewhere on a cluster.

The one seam between a stage and whoever computes for it. A stage says what all items share
(`prepare`, called once in each process that works) and what is done with each (`work`); results
come in the order of the items, so that a stage cannot tell where they were made.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import Protocol, TypeVar

from walltopo.core.ahead import ahead

__all__ = ["Here", "Workers"]

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

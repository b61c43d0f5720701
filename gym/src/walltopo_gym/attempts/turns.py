"""Which of the due items are begun, so that one gym's load delays no other gym."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence
from typing import Any
from uuid import UUID


def fair_share(due: Sequence[Any], busy: Iterable[UUID], each: int) -> list[UUID]:
    """Return the due items that may begin, at most `each` of one gym at a time.

    Parameters
    ----------
    due : rows of item and gym, in the order in which they are begun.
    busy : the gym of each item that is being worked on.
    """
    held = Counter(busy)
    chosen = []
    for item, gym in due:
        if held[gym] < each:
            held[gym] += 1
            chosen.append(item)
    return chosen

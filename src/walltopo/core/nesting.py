"""How deep values of JSON or TOML lie in each other."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

__all__ = ["deeper_than"]


def deeper_than(most: int, value: Any) -> bool:
    """Whether lists and tables lie in each other more than `most` deep; without recursion."""
    level: list[Any] = [value]
    for _ in range(most + 1):
        level = [item for outer in level for item in _items(outer)]
        if not level:
            return False
    return True


def _items(value: Any) -> Iterable[Any]:
    if isinstance(value, dict):
        return value.values()
    return value if isinstance(value, (list, tuple)) else ()

"""How much two orders of moves differ."""

from __future__ import annotations

from collections.abc import Sequence


def order_difference(first: Sequence[object], second: Sequence[object]) -> float:
    """Return the edit distance of two orders, as a share of the longer one; 0 for two empty ones.

    The distance counts moves that are left out, added or exchanged for another (V. I. Levenshtein,
    1966).
    """
    row = list(range(len(second) + 1))
    for i, left in enumerate(first, 1):
        before, row[0] = row[0], i
        for j, right in enumerate(second, 1):
            change = before + (left != right)
            before, row[j] = row[j], min(row[j] + 1, row[j - 1] + 1, change)
    return row[-1] / max(len(first), len(second), 1)

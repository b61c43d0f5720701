"""How hard the climbers find a route: one grade, once enough of them have said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

# Of fewer votes one person's word would be read as everybody's.
ENOUGH: Final = 3


def crowd_grade(votes: Mapping[str, int], labels: Sequence[str]) -> str:
    """The median vote, the easier one of two; empty where fewer than `ENOUGH` have voted.

    Parameters
    ----------
    votes : label to number; labels : of the route's grade system, from the easiest to the hardest.
        Votes for a label that it has no more do not count.
    """
    counted = [(label, votes[label]) for label in labels if votes.get(label)]
    whole = sum(number for _, number in counted)
    if whole < ENOUGH:
        return ""
    below = 0
    for label, number in counted:
        below += number
        if 2 * below >= whole:
            return label
    raise AssertionError("the last vote is at the end")

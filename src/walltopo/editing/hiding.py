"""The hidden places that a log of edits leaves."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from walltopo.scans.edits import Edit, Hide, Unhide
from walltopo.scans.hidden import HiddenPlace


def hidden_after(edits: Sequence[Edit]) -> tuple[HiddenPlace, ...]:
    """Return the places that are hidden after a log."""
    places: tuple[HiddenPlace, ...] = ()
    for edit in edits:
        if isinstance(edit, Hide):
            places = (*places, HiddenPlace(edit.at, edit.radius_m))
        elif isinstance(edit, Unhide):
            places = without_place(places, edit)
    return places


def without_place(places: Sequence[HiddenPlace], edit: Unhide) -> tuple[HiddenPlace, ...]:
    """Return the places that stay hidden; as many as before if none contains the edit's place.

    The balls of a stroke overlap, and all of them are shown again.
    """
    reached = [place for place in places if _distance(place.at, edit.at) <= place.radius_m]
    rest = [place for place in places if place not in reached]
    while reached:
        last = reached.pop()
        linked = [place for place in rest if _overlap(last, place)]
        reached += linked
        rest = [place for place in rest if place not in linked]
    return tuple(rest)


def _distance(a: Sequence[float], b: Sequence[float]) -> float:
    return float(np.linalg.norm(np.subtract(a, b)))


def _overlap(a: HiddenPlace, b: HiddenPlace) -> bool:
    return _distance(a.at, b.at) <= a.radius_m + b.radius_m

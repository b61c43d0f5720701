"""An attempt at a route: its contacts, the route that fits them, its start, top and fall."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from walltopo.scans.routes import Route
from walltopo_climb.beta.contacts import WALL, Contact, find_contacts
from walltopo_climb.beta.in_view import (
    Floats,
    Frames,
    Observations,
    WallHolds,
    observe,
    runs_of,
)

_HANDS: Final = (0, 1)
_FALL_SPEED: Final = 2.2  # m/s of the hips; climbers who step down stay below 1 m/s
_FALL_S: Final = 0.2
_TOP_S: Final = 0.7  # both hands hold the top so long
_SURE: Final = 0.5  # least confidence of a contact that makes a top
_FEW: Final = 3  # fewer hand contacts name no route


@dataclass(frozen=True)
class Attempt:
    """One attempt, as a clip shows it.

    Parameters
    ----------
    contacts : from the start to the end of the climb, in order of their begin.
    route : id of the route that fits best, None where too little was climbed.
    foreign : share of the hands' contacts with holds of other routes, in [0, 1].
    start : s, when both hands are on the route's start holds, or on any holds with a foot off the
        ground; None: never.
    top : s, when both hands hold the top; fall : s, when the body falls; None: they do not.
    """

    contacts: tuple[Contact, ...]
    route: int | None
    foreign: float
    start: float | None
    top: float | None
    fall: float | None


def attempt_of(
    frames: Frames, holds: WallHolds, routes: Sequence[Route], route: int | None = None
) -> Attempt:
    """Return the attempt of a clip.

    Parameters
    ----------
    holds : of the wall; volumes count for every route. route : id of the route, if it is known.
    """
    observations = observe(frames, holds)
    contacts = find_contacts(frames, holds, observations)
    fall = _fall_begin(frames, observations)
    if route is None:
        route = _best_route(_on_routes(_contacts_of_climb(contacts, None, fall), routes), routes)
    chosen = next((one for one in routes if one.id == route), None)
    if chosen is None:
        start = _off_the_ground(contacts)
        return Attempt(_contacts_of_climb(contacts, start, fall), None, 0.0, start, None, fall)
    start = _both_hands_time(contacts, chosen.start, 0.0)
    if start is None:
        start = _off_the_ground(contacts)
    climbed = _contacts_of_climb(contacts, start, fall)
    used = _on_routes(climbed, routes)
    foreign = sum(one.hold not in chosen.holds for one in used) / max(len(used), 1)
    sure = [one for one in climbed if one.confidence >= _SURE]
    return Attempt(
        climbed, chosen.id, foreign, start, _both_hands_time(sure, chosen.top, _TOP_S), fall
    )


def _on_routes(contacts: Iterable[Contact], routes: Iterable[Route]) -> list[Contact]:
    """Return the hands' contacts with holds of routes; volumes tell no route."""
    of_routes = {hold for one in routes for hold in one.holds}
    return [one for one in contacts if one.limb in _HANDS and one.hold in of_routes]


def _off_the_ground(contacts: Iterable[Contact]) -> float | None:
    """Return the first time with both hands on holds and a foot on a hold or on the wall."""
    held = list(contacts)
    hands = [[one for one in held if one.limb == limb and one.hold != WALL] for limb in _HANDS]
    feet = [one for one in held if one.limb not in _HANDS]
    times = [
        max(left.begin, right.begin, foot.begin)
        for left in hands[0]
        for right in hands[1]
        for foot in feet
        if max(left.begin, right.begin, foot.begin) < min(left.end, right.end, foot.end)
    ]
    return min(times, default=None)


def _contacts_of_climb(
    contacts: Iterable[Contact], start: float | None, fall: float | None
) -> tuple[Contact, ...]:
    """Return the contacts of the climb: hands that hang beside a hold on the ground are none."""
    since, until = (-np.inf if start is None else start), (np.inf if fall is None else fall)
    return tuple(one for one in contacts if one.end > since and one.begin < until)


def _best_route(contacts: Sequence[Contact], routes: Iterable[Route]) -> int | None:
    """Return the id of the route with most of the hands' contacts, the lower id if equal.

    Hands that hold a route's start together count as two contacts more.
    """
    counts = {one.id: sum(contact.hold in one.holds for contact in contacts) for one in routes}
    begun = {one.id: 2 * (_both_hands_time(contacts, one.start, 0.0) is not None) for one in routes}
    best = max(sorted(counts), key=lambda key: counts[key] + begun[key], default=None)
    if best is None or counts[best] + begun[best] < _FEW:
        return None
    return best if 2 * counts[best] > len(contacts) else None


def _both_hands_time(
    contacts: Iterable[Contact], holds: Collection[int], seconds: float
) -> float | None:
    """Return the first time from which both hands are on some of these holds for `seconds`."""
    hands: list[list[Contact]] = [[], []]
    for one in contacts:
        if one.limb in _HANDS and one.hold in holds:
            hands[one.limb].append(one)
    times = [
        max(left.begin, right.begin)
        for left in hands[0]
        for right in hands[1]
        if min(left.end, right.end) - max(left.begin, right.begin) > seconds
    ]
    return min(times, default=None)


def _fall_begin(frames: Frames, observations: Observations) -> float | None:
    """Return the begin of the first fast drop of the hips."""
    down = frames.hips[:, 1] * observations.metres_per_px
    speed = _running_median(np.gradient(down, frames.times))
    fast = speed > _FALL_SPEED
    for begin, end in runs_of(fast):
        last = min(end, len(fast) - 1)
        if fast[begin] and frames.times[last] - frames.times[begin] >= _FALL_S:
            return float(frames.times[begin])
    return None


def _running_median(values: Floats) -> Floats:
    """Return the running median of three."""
    padded = np.pad(values, 1, mode="edge")
    return np.median(np.stack([padded[:-2], padded[1:-1], padded[2:]]), axis=0)

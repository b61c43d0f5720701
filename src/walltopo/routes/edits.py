"""A setter's corrections, put on what the program found; see `formats.edits` for the files.

A hold of a correction is looked for at its place first: the nearest hold within `REACH`. Only
if none is there, the id is used, and only while that hold is not farther than `FAR` from the
place: after a reset the id may belong to a hold at the other end of the wall. Corrections that
find nothing are left out and told, they never fail a run.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from walltopo.scans.attributes import Hold

__all__ = ["RouteBook", "apply_hold_edits", "apply_route_edits", "find_hold"]

REACH = 0.12  # metres: a hold this near to the place is the one that was meant
FAR = 0.5  # metres: beyond it even the right id is another hold


def find_hold(
    holds: Sequence[Hold], place: Sequence[float], number: int | None, unit: float
) -> Hold | None:
    """The hold that a correction means, or None.

    Parameters
    ----------
    place : (3,) metres, world frame; number : its id when the correction was made, if known.
    unit : scan units a metre.
    """
    if not holds:
        return None
    distance = np.linalg.norm(np.array([hold.position for hold in holds]) - place, axis=1)
    nearest = int(distance.argmin())
    if distance[nearest] <= REACH * unit:
        return holds[nearest]
    for hold, far in zip(holds, distance.tolist(), strict=True):
        if hold.id == number and far <= FAR * unit:
            return hold
    return None


def _with_kind(hold: Hold, kind: str) -> Hold:
    if kind == hold.kind:
        return hold
    if kind == "volume":
        return replace(hold, kind=kind, role="volume", type="volume", type_confidence=1.0)
    return replace(hold, kind=kind, role="hold", type="unknown", type_confidence=0.0)


def apply_hold_edits(
    holds: Sequence[Hold], edits: Sequence[Mapping[str, Any]], unit: float
) -> tuple[list[Hold], list[str]]:
    """Correct class, colour and type of holds, and take deleted ones out.

    A corrected colour or type has confidence 1, and the hold needs no review any more.

    Returns
    -------
    The holds, and one line per edit that found no hold.
    """
    current = {hold.id: hold for hold in holds}
    lost: list[str] = []
    for edit in edits:
        hold = find_hold(holds, edit["at"], edit["id"], unit)
        if hold is None or hold.id not in current:
            lost.append(f"edit of hold {edit['id']}: no hold there any more")
            continue
        if edit.get("deleted", False):
            del current[hold.id]
            continue
        changed = _with_kind(current[hold.id], edit.get("class", hold.kind))
        if "colour" in edit:
            changed = replace(changed, colour=edit["colour"], colour_confidence=1.0)
        if "type" in edit:
            changed = replace(changed, type=edit["type"], type_confidence=1.0)
        current[hold.id] = replace(changed, review=False)
    return list(current.values()), lost


@dataclass
class RouteBook:
    """Which hold belongs to which route, while corrections are put on.

    Parameters
    ----------
    route_of : hold id to route id; holds without a route are absent.
    names, colours : of routes, where a setter gave them.
    decided : holds that a setter placed, never ambiguous.
    """

    route_of: dict[int, int]
    names: dict[int, str] = field(default_factory=dict)
    colours: dict[int, str] = field(default_factory=dict)
    decided: set[int] = field(default_factory=set)

    def members(self, route: int) -> list[int]:
        """Hold ids of a route."""
        return [hold for hold, number in self.route_of.items() if number == route]

    def fresh(self) -> int:
        """A route id that is not in use."""
        return max(self.route_of.values(), default=0) + 1


class _Finder:
    """Looks up what corrections mean, and keeps what they did not find."""

    def __init__(self, book: RouteBook, holds: Sequence[Hold], unit: float) -> None:
        self.book, self.holds, self.unit = book, holds, unit
        self.lost: list[str] = []

    def hold(self, place: Sequence[float], number: int | None) -> int | None:
        found = find_hold(self.holds, place, number, self.unit)
        return None if found is None else found.id

    def route(self, place: Sequence[float], number: int) -> int | None:
        """The route that has the hold at a place; the id only if no hold is there."""
        hold = self.hold(place, None)
        if hold is not None and hold in self.book.route_of:
            return self.book.route_of[hold]
        return None if hold is not None or not self.book.members(number) else number

    def missing(self, what: str) -> None:
        self.lost.append(f"{what}: not on the wall any more")


def _merge(find: _Finder, edit: Mapping[str, Any]) -> None:
    routes = [
        route
        for number, place in zip(edit["routes"], edit["at"], strict=False)
        if (route := find.route(place, number)) is not None
    ]
    if len(routes) < 2:
        find.missing(f"merge of routes {edit['routes']}")
        return
    for hold, route in list(find.book.route_of.items()):
        if route in routes:
            find.book.route_of[hold] = routes[0]
            find.book.decided.add(hold)


def _place(find: _Finder, holds: Iterable[int], route: int) -> None:
    for hold in holds:
        find.book.route_of[hold] = route
        find.book.decided.add(hold)


def _split(find: _Finder, edit: Mapping[str, Any]) -> None:
    pairs = zip(edit["holds"], edit["at"], strict=False)
    found = [find.hold(place, number) for number, place in pairs]
    holds = [hold for hold in found if hold is not None]
    if not holds:
        find.missing(f"split of route {edit['route']}")
        return
    rest = {find.book.route_of[hold] for hold in holds if hold in find.book.route_of}
    find.book.decided.update(hold for route in rest for hold in find.book.members(route))
    _place(find, holds, find.book.fresh())


def _assign(find: _Finder, edit: Mapping[str, Any]) -> None:
    hold = find.hold(edit["at"], edit["hold"])
    if hold is None:
        find.missing(f"hold {edit['hold']}")
        return
    if edit["route"] == 0:
        find.book.route_of.pop(hold, None)
        find.book.decided.add(hold)
        return
    place = edit.get("route_at")
    route = edit["route"] if place is None else find.route(place, edit["route"])
    if route is None:
        find.missing(f"route {edit['route']} of hold {edit['hold']}")
        return
    _place(find, [hold], route)


def apply_route_edits(
    book: RouteBook, holds: Sequence[Hold], edits: Mapping[str, Any], unit: float
) -> list[str]:
    """Merge, split, assign, rename and recolour routes, in this order of kinds.

    Parameters
    ----------
    book : changed in place.
    holds : all holds of the scan (volumes are in no route and cannot be assigned).
    edits : as `formats.edits.read_route_edits` gives them.

    Returns
    -------
    One line per edit that found nothing.
    """
    find = _Finder(book, [hold for hold in holds if hold.role != "volume"], unit)
    for kind, action in (("merge", _merge), ("split", _split), ("assign", _assign)):
        for edit in edits.get(kind, ()):
            action(find, edit)
    for kind, values in (("name", book.names), ("colour", book.colours)):
        for edit in edits.get("rename" if kind == "name" else kind, ()):
            route = find.route(edit["at"], edit["route"])
            if route is None:
                find.missing(f"{kind} of route {edit['route']}")
            else:
                values[route] = str(edit[kind])
    return find.lost

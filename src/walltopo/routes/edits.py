"""A setter's corrections of routes, put on what the program found.

Corrections that find nothing are left out and told, they never fail a run.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

from walltopo.scans.attributes import Hold
from walltopo.scans.old_edits import (
    Assign,
    Merge,
    Recolour,
    Rename,
    RouteEdits,
    Split,
    find_hold,
)

__all__ = ["RouteBook", "apply_route_edits"]


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

    def named(self, edit: Rename | Recolour, what: str) -> int | None:
        """The route whose name or colour an edit gives; told where it is not there."""
        route = self.route(edit.at, edit.route)
        if route is None:
            self.missing(f"{what} of route {edit.route}")
        return route

    def missing(self, what: str) -> None:
        self.lost.append(f"{what}: not on the wall any more")


def _merge(find: _Finder, edit: Merge) -> None:
    routes = [
        route
        for number, place in zip(edit.routes, edit.at, strict=True)
        if (route := find.route(place, number)) is not None
    ]
    if len(routes) < 2:
        find.missing(f"merge of routes {edit.routes}")
        return
    for hold, route in list(find.book.route_of.items()):
        if route in routes:
            find.book.route_of[hold] = routes[0]
            find.book.decided.add(hold)


def _place(find: _Finder, holds: Iterable[int], route: int) -> None:
    for hold in holds:
        find.book.route_of[hold] = route
        find.book.decided.add(hold)


def _split(find: _Finder, edit: Split) -> None:
    pairs = zip(edit.holds, edit.at, strict=True)
    found = [find.hold(place, number) for number, place in pairs]
    holds = [hold for hold in found if hold is not None]
    if not holds:
        find.missing(f"split of route {edit.route}")
        return
    rest = {find.book.route_of[hold] for hold in holds if hold in find.book.route_of}
    find.book.decided.update(hold for route in rest for hold in find.book.members(route))
    _place(find, holds, find.book.fresh())


def _assign(find: _Finder, edit: Assign) -> None:
    hold = find.hold(edit.at, edit.hold)
    if hold is None:
        find.missing(f"hold {edit.hold}")
        return
    if edit.route == 0:
        find.book.route_of.pop(hold, None)
        find.book.decided.add(hold)
        return
    place = edit.route_at
    route = edit.route if place is None else find.route(place, edit.route)
    if route is None:
        find.missing(f"route {edit.route} of hold {edit.hold}")
        return
    _place(find, [hold], route)


def apply_route_edits(
    book: RouteBook, holds: Sequence[Hold], edits: RouteEdits, unit: float
) -> list[str]:
    """Merge, split, assign, rename and recolour routes, in this order of kinds.

    Parameters
    ----------
    book : changed in place.
    holds : all holds of the scan (volumes are in no route and cannot be assigned).

    Returns
    -------
    One line per edit that found nothing.
    """
    find = _Finder(book, [hold for hold in holds if hold.role != "volume"], unit)
    for merge in edits.merge:
        _merge(find, merge)
    for split in edits.split:
        _split(find, split)
    for assign in edits.assign:
        _assign(find, assign)
    for rename in edits.rename:
        if (route := find.named(rename, "name")) is not None:
            book.names[route] = rename.name
    for recolour in edits.colour:
        if (route := find.named(recolour, "colour")) is not None:
            book.colours[route] = recolour.colour
    return find.lost

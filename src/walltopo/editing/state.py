"""The state that a log of edits changes: the scan's holds, routes and labels at one entry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.observations import HoldView
from walltopo.editing.messages import MissingError
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.scans.edits import Ref, RoleName
from walltopo.scans.hidden import HiddenPlace
from walltopo.scans.holds import Hold

REACH = 0.12  # metres: a hold this near to the place of a reference is the one meant
FAR = 0.5  # metres: a hold with the right id but farther away is another hold
GAP = 1000  # maximum number of ids that all entries together may skip


@dataclass(frozen=True)
class RouteFacts:
    """A setter's facts about a route; a text is empty if the setter gave none."""

    name: str = ""
    colour: str = ""
    grade: str = ""
    setter: str = ""
    description: str = ""
    date: str = ""
    proposed: bool = False


@dataclass(eq=False)
class EditState:
    """The state that entries change.

    Parameters
    ----------
    labels : (F,) int32, a copy of the snapshot's.
    holds : by id; non_holds : low-confidence and removed instances by id, the scan's first.
    route_of : hold id to route id; holds without a route are absent.
    shared : route id to the holds that it has beside their own route, in the order of addition.
    facts : of routes by id, if a setter gave any.
    roles : (route, hold) to the role that a setter gave.
    decided : holds that a setter placed, never ambiguous.
    reshaped : ids of instances whose triangles changed.
    by_setter : hold id to "colour" and "type" if a setter gave them.
    cut_off : ids of parts that were cut off other holds.
    measured_rows : hold id to the triangles of its colour, if these are not the scan's.
    hidden : places that are hidden in texture and photos.
    pictures : hold id to the view in the photo that shows it best, if an edit measured it.
    hold_names, route_names : id that an entry gives to a new item, to the id that it got.
    """

    snapshot: ScanSnapshot
    labels: NDArray[np.int32]
    holds: dict[int, Hold]
    non_holds: dict[int, Hold]
    route_of: dict[int, int]
    shared: dict[int, list[int]] = field(default_factory=dict)
    facts: dict[int, RouteFacts] = field(default_factory=dict)
    roles: dict[tuple[int, int], RoleName] = field(default_factory=dict)
    decided: set[int] = field(default_factory=set)
    reshaped: set[int] = field(default_factory=set)
    by_setter: dict[int, set[str]] = field(default_factory=dict)
    cut_off: set[int] = field(default_factory=set)
    measured_rows: dict[int, NDArray[np.int64]] = field(default_factory=dict)
    hidden: tuple[HiddenPlace, ...] = ()
    pictures: dict[int, HoldView | None] = field(default_factory=dict)
    hold_names: dict[int, int] = field(default_factory=dict)
    route_names: dict[int, int] = field(default_factory=dict)
    last_hold: int = 0
    last_route: int = 0
    first_hold: int = 0  # the highest id before the first entry
    first_route: int = 0

    @classmethod
    def of(cls, snapshot: ScanSnapshot) -> EditState:
        """Return the state before the first entry."""
        instances = snapshot.found.holds
        non_holds = {hold.id: hold for hold in snapshot.found.left_out}
        routes = snapshot.routes.routes
        ids = [*snapshot.numbers, *non_holds, *(hold.id for hold in instances)]
        last_hold = max(ids, default=0)
        last_route = max((route.id for route in routes), default=0)
        return cls(
            snapshot=snapshot,
            labels=snapshot.labels.copy(),
            holds={hold.id: hold for hold in instances},
            non_holds=non_holds,
            route_of={hold: route.id for route in reversed(routes) for hold in route.holds},
            last_hold=last_hold,
            last_route=last_route,
            first_hold=last_hold,
            first_route=last_route,
        )

    # Resolve the references of an entry.

    def hold(self, ref: Ref) -> Hold:
        """Return the hold that a reference means; raise MissingError if it does not exist."""
        found = self._nearest(list(self.holds.values()), ref)
        if found is None:
            raise MissingError("hold_gone", ref.id)
        return found

    def non_hold(self, ref: Ref) -> Hold | None:
        """Return the low-confidence instance that a reference means, or None."""
        return self._nearest(list(self.non_holds.values()), ref)

    def route(self, ref: Ref) -> int:
        """Return the route of the hold at a place; by id if the hold has several or is missing."""
        number = self.route_names.get(ref.id, ref.id)
        if ref.at is not None:
            climbed = [hold for hold in self.holds.values() if hold.role != "volume"]
            hold = self._nearest(climbed, Ref(0, ref.at))
            if hold is not None and number not in (among := self.routes_of(hold.id)):
                number = among[0] if among else -1
        if number not in self.routes:
            raise MissingError("route_gone", ref.id)
        return number

    def _nearest(self, holds: Sequence[Hold], ref: Ref) -> Hold | None:
        """Return the hold within `REACH` of the place; else by id, if within `FAR`.

        After a reset, the id may belong to a hold at the other end of the wall.
        """
        if not holds:
            return None
        number = self.hold_names.get(ref.id, ref.id)
        own = next((hold for hold in holds if hold.id == number), None)
        if ref.at is None:
            return own
        positions = np.array([hold.position for hold in holds])
        distance = np.linalg.norm(positions - ref.at, axis=1)
        nearest = int(distance.argmin())
        if distance[nearest] <= REACH * self.snapshot.unit:
            return holds[nearest]
        if own is not None and distance[holds.index(own)] <= FAR * self.snapshot.unit:
            return own
        return None

    # Ids of new items.

    def new_hold(self, wanted: int) -> int:
        """Return an id for a new hold: the wanted one if it is free."""
        number = _free_id(
            wanted,
            {*self.holds, *self.non_holds, *self.snapshot.numbers},
            self.first_hold,
            self.last_hold,
        )
        self.last_hold, self.hold_names[wanted] = max(number, self.last_hold), number
        return number

    def new_route(self, wanted: int) -> int:
        """Return an id for a new route: the wanted one if it is free."""
        number = _free_id(wanted, self.routes, self.first_route, self.last_route)
        self.last_route, self.route_names[wanted] = max(number, self.last_route), number
        return number

    # Changes that several kinds of entries share.

    @property
    def routes(self) -> set[int]:
        """Return the ids of the routes that have a hold."""
        return {*self.route_of.values(), *self.shared}

    def routes_of(self, hold: int) -> list[int]:
        """Return the routes of a hold, its own one first."""
        own = [self.route_of[hold]] if hold in self.route_of else []
        return own + sorted(route for route, holds in self.shared.items() if hold in holds)

    def members(self, route: int) -> list[Hold]:
        """Return the holds of a route."""
        own = [hold for hold, number in self.route_of.items() if number == route]
        return [self.holds[hold] for hold in [*own, *self.shared.get(route, ())]]

    def share(self, hold: int, route: int) -> None:
        """Add a hold to a route beside its own one."""
        if route not in self.routes_of(hold):
            self.shared.setdefault(route, []).append(hold)

    def leave(self, hold: int, route: int) -> None:
        """Remove a hold from a route; its other routes keep it."""
        if self.route_of.get(hold) == route:
            del self.route_of[hold]
        kept = [other for other in self.shared.pop(route, []) if other != hold]
        if kept:
            self.shared[route] = kept
        self.roles.pop((route, hold), None)

    def place(self, hold: int, route: int) -> None:
        """Make this the hold's own route (0: none); its role in the previous one is lost."""
        if self.route_of.get(hold, 0) == route:
            return
        if hold in self.route_of:
            self.leave(hold, self.route_of[hold])
        if route:
            self.leave(hold, route)
            self.route_of[hold] = route

    def forget_roles(self, hold: int) -> None:
        """Remove all roles of a hold."""
        for key in [key for key in self.roles if key[1] == hold]:
            del self.roles[key]

    def drop(self, hold: int) -> Hold:
        """Remove a hold and return it."""
        for route in self.routes_of(hold):
            self.leave(hold, route)
        self.forget_roles(hold)
        return self.holds.pop(hold)

    def relabel(self, rows: NDArray[np.int64], number: int) -> None:
        """Assign triangles to a hold (0: the wall), and update the positions of affected holds.

        A hold without triangles is removed.
        """
        before = self.labels[rows]
        changed = rows[before != number]
        touched = set(np.unique(before[before != number]).tolist()) | {number}
        self.labels[changed] = number
        if len(changed):
            self.reshape(touched - {0})

    def reshape(self, touched: Iterable[int]) -> None:
        """Record that the triangles of these instances changed."""
        mesh = self.snapshot.mesh
        for number in touched:
            self.reshaped.add(number)
            rows = np.flatnonzero(self.labels == number)
            if len(rows) == 0:
                self.non_holds.pop(number, None)
                if number in self.holds:
                    self.drop(number)
                continue
            weights = np.maximum(mesh.areas[rows], 1e-12)
            x, y, z = (weights @ mesh.centroids[rows] / weights.sum()).tolist()
            if number in self.holds:
                self.holds[number] = replace(self.holds[number], position=(x, y, z))
            elif number in self.non_holds:
                self.non_holds[number] = replace(self.non_holds[number], position=(x, y, z))


def _free_id(wanted: int, taken: set[int], first: int, last: int) -> int:
    """Return the wanted id if it is free and leaves no large gap in the tables, else the next.

    Parameters
    ----------
    first : the highest id before the first entry; last : the highest id now.
    """
    return wanted if 0 < wanted <= first + GAP and wanted not in taken else last + 1

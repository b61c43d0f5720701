"""What a log of edits changes: the scan's holds, routes and labels, as they stand at an entry."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import numpy as np
from msgspec.structs import replace
from numpy.typing import NDArray

from walltopo.describe.classify.observations import HoldView
from walltopo.editing.notes import MissingError
from walltopo.editing.snapshot import ScanSnapshot
from walltopo.scans.attributes import Doubtful, Hold
from walltopo.scans.edits import Ref, RoleName

REACH = 0.12  # metres: a hold this near to the place is the one that was meant
FAR = 0.5  # metres: beyond it even the right id is another hold
GAP = 1000  # ids that an entry may leave free


@dataclass(frozen=True)
class RouteFacts:
    """What is said of a route; empty where nothing."""

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
    labels : (F,) int32, of this board alone.
    holds : by id; out : instances that are no holds, by id, the scan's first.
    route_of : hold id to route id; holds without a route are absent.
    shared : route id to the holds that it has beside their own route, in the order they came.
    facts : of routes, by id, where a setter said something.
    roles : (route, hold) to what a setter says of it.
    decided : holds that a setter placed, never ambiguous.
    reshaped : ids of instances whose triangles are not the scan's.
    said : of holds, what of "colour" and "type" a setter said; cut_off : ids of parts of others.
    read : of holds, the triangles that their colour was read of, where these are not the scan's.
    pictures : of holds that were read by hand, what the photo that shows them best shows.
    names : an id that an entry gives to something new, to the id that it got.
    """

    scanned: ScanSnapshot
    labels: NDArray[np.int32]
    holds: dict[int, Hold]
    out: dict[int, Doubtful]
    scores: dict[int, float]
    route_of: dict[int, int]
    shared: dict[int, list[int]] = field(default_factory=dict)
    facts: dict[int, RouteFacts] = field(default_factory=dict)
    roles: dict[tuple[int, int], RoleName] = field(default_factory=dict)
    decided: set[int] = field(default_factory=set)
    reshaped: set[int] = field(default_factory=set)
    said: dict[int, set[str]] = field(default_factory=dict)
    cut_off: set[int] = field(default_factory=set)
    read: dict[int, NDArray[np.int64]] = field(default_factory=dict)
    pictures: dict[int, HoldView | None] = field(default_factory=dict)
    hold_names: dict[int, int] = field(default_factory=dict)
    route_names: dict[int, int] = field(default_factory=dict)
    last_hold: int = 0
    last_route: int = 0

    @classmethod
    def of(cls, scanned: ScanSnapshot) -> EditState:
        """The scan before the first entry."""
        instances = scanned.found.instances
        out = {row.hold.id: row for row in scanned.found.left_out}
        routes = scanned.routes.routes
        return cls(
            scanned=scanned,
            labels=scanned.labels.copy(),
            holds={hold.id: hold for hold in instances},
            out=out,
            scores=dict(scanned.scores),
            route_of={hold: route.id for route in reversed(routes) for hold in route.holds},
            last_hold=max(
                [*scanned.scores, *out, *(hold.id for hold in instances), 0]
                + [int(scanned.labels.max(initial=0))]
            ),
            last_route=max((route.id for route in routes), default=0),
        )

    # Looking up what an entry means.

    def hold(self, ref: Ref) -> Hold:
        """The hold that is meant; MissingError where it is not there."""
        found = self._nearest(list(self.holds.values()), ref)
        if found is None:
            raise MissingError("hold_gone", ref.id)
        return found

    def left_out(self, ref: Ref) -> Doubtful | None:
        """The left-out instance that is meant, if there is one."""
        found = self._nearest([row.hold for row in self.out.values()], ref)
        return None if found is None else self.out[found.id]

    def route(self, ref: Ref) -> int:
        """The route that has the hold at a place; by id if several have it, or no hold is there."""
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
        """By place: within `REACH`; else by id, while that one is not farther than `FAR`.

        After a reset the id may belong to a hold at the other end of the wall.
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
        if distance[nearest] <= REACH * self.scanned.unit:
            return holds[nearest]
        if own is not None and distance[holds.index(own)] <= FAR * self.scanned.unit:
            return own
        return None

    # Ids of what is new.

    def new_hold(self, wanted: int) -> int:
        """An id for a new hold: the wanted one where it is free."""
        number = _free(wanted, {*self.holds, *self.out, *self.scores}, self.last_hold)
        self.last_hold, self.hold_names[wanted] = max(number, self.last_hold), number
        return number

    def new_route(self, wanted: int) -> int:
        """An id for a new route: the wanted one where it is free."""
        number = _free(wanted, self.routes, self.last_route)
        self.last_route, self.route_names[wanted] = max(number, self.last_route), number
        return number

    # Changes that several kinds of entries make.

    @property
    def routes(self) -> set[int]:
        """Ids of the routes that have a hold."""
        return {*self.route_of.values(), *self.shared}

    def routes_of(self, hold: int) -> list[int]:
        """The routes that a hold is on, its own one first."""
        own = [self.route_of[hold]] if hold in self.route_of else []
        return own + sorted(route for route, holds in self.shared.items() if hold in holds)

    def members(self, route: int) -> list[Hold]:
        """The holds of a route."""
        own = [hold for hold, number in self.route_of.items() if number == route]
        return [self.holds[hold] for hold in [*own, *self.shared.get(route, ())]]

    def share(self, hold: int, route: int) -> None:
        """Put a hold into a route beside its own one."""
        if route not in self.routes_of(hold):
            self.shared.setdefault(route, []).append(hold)

    def leave(self, hold: int, route: int) -> None:
        """Take a hold out of a route; its others keep it."""
        if self.route_of.get(hold) == route:
            del self.route_of[hold]
        kept = [other for other in self.shared.pop(route, []) if other != hold]
        if kept:
            self.shared[route] = kept
        self.roles.pop((route, hold), None)

    def place(self, hold: int, route: int) -> None:
        """Make this the hold's own route (0: none); its role in the one before is gone."""
        if self.route_of.get(hold, 0) == route:
            return
        if hold in self.route_of:
            self.leave(hold, self.route_of[hold])
        if route:
            self.leave(hold, route)
            self.route_of[hold] = route

    def forget_roles(self, hold: int) -> None:
        """Take away what was said of a hold's role."""
        for key in [key for key in self.roles if key[1] == hold]:
            del self.roles[key]

    def drop(self, hold: int) -> Hold:
        """Take a hold out; gives it."""
        for route in self.routes_of(hold):
            self.leave(hold, route)
        self.forget_roles(hold)
        return self.holds.pop(hold)

    def relabel(self, rows: NDArray[np.int64], number: int) -> None:
        """Give triangles to a hold (0: the wall), and move the holds that this changes.

        A hold that has no triangle left is gone.
        """
        before = self.labels[rows]
        changed = rows[before != number]
        touched = set(np.unique(before[before != number]).tolist()) | {number}
        self.labels[changed] = number
        if len(changed):
            self.reshape(touched - {0})

    def reshape(self, touched: Iterable[int]) -> None:
        """Note that these instances have other triangles now."""
        mesh = self.scanned.mesh
        for number in touched:
            self.reshaped.add(number)
            rows = np.flatnonzero(self.labels == number)
            if len(rows) == 0:
                self.out.pop(number, None)
                if number in self.holds:
                    self.drop(number)
                continue
            weights = np.maximum(mesh.areas[rows], 1e-12)
            x, y, z = (weights @ mesh.centroids[rows] / weights.sum()).tolist()
            if number in self.holds:
                self.holds[number] = replace(self.holds[number], position=(x, y, z))
            elif number in self.out:
                row = self.out[number]
                moved = replace(row.hold, position=(x, y, z))
                self.out[number] = replace(row, hold=moved)


def _free(wanted: int, taken: set[int], last: int) -> int:
    """The wanted id, or the next one: it is taken, or so high that tables would be all gaps."""
    return wanted if 0 < wanted <= last + GAP and wanted not in taken else last + 1

"""`routes.json`: which holds belong together, and how people call a route."""

from __future__ import annotations

import msgspec

from walltopo.scans.document import Coordinate, Count, Document, Label, Rgb, Share


class Ambiguous(msgspec.Struct, frozen=True):
    """A hold that two routes could own: its probability by route id."""

    hold: Label
    routes: dict[str, Share]


class Route(msgspec.Struct, frozen=True):
    """One route. Lengths are world units: metres where `Scale.metric`; the file's keys are
    `length_m` and `largest_move_m`.

    Parameters
    ----------
    id : >= 1.
    name, grade, setter, description : given by a setter, else empty.
    date : when it was set, ISO (2026-03-01), given by a setter, else empty.
    colour : the colour of its holds, or what a setter says; colour_rgb : what that looks like.
    holds : ids from bottom to top (hand holds and footholds; volumes are in no list because
        they belong to every route).
    length : of the way from hand hold to hand hold.
    steepness_deg : mean wall angle under its holds.
    steepness_profile : (height above the lowest hold, degrees) per hand hold.
    largest_move : longest distance from a hand hold to the nearest lower one.
    holds_by_type : type to count.
    start, top : ids of the start (one or two holds) and of the last hold.
    zone : ids of the holds that a setter made the zone.
    footholds : ids of holds for feet alone: too small for hands, or a setter says so.
    doubtful_start, doubtful_top : why someone should have a look; empty where all speaks for them.
    ambiguous : holds that two routes could own.
    proposed : by walltopo, and climbed by nobody yet.
    """

    id: Label
    name: str = ""
    colour: str = ""
    holds: tuple[Label, ...] = ()
    length: Coordinate = msgspec.field(name="length_m", default=0.0)
    steepness_deg: Coordinate = 0.0
    steepness_profile: tuple[tuple[Coordinate, Coordinate], ...] = ()
    largest_move: Coordinate = msgspec.field(name="largest_move_m", default=0.0)
    holds_by_type: dict[str, Count] = {}
    start: tuple[Label, ...] = ()
    top: tuple[Label, ...] = ()
    zone: tuple[Label, ...] = ()
    footholds: tuple[Label, ...] = ()
    ambiguous: tuple[Ambiguous, ...] = ()
    doubtful_start: str = ""
    doubtful_top: str = ""
    grade: str = ""
    setter: str = ""
    description: str = ""
    date: str = ""
    colour_rgb: Rgb = (128, 128, 128)
    proposed: bool = False


class Routes(Document, frozen=True, kw_only=True):
    """`routes.json`.

    Parameters
    ----------
    routes : from left to right.
    unrouted : ids of holds without a route; volumes : ids of volumes (on every route).
    """

    routes: tuple[Route, ...]
    unrouted: tuple[Label, ...] = ()
    volumes: tuple[Label, ...] = ()


def route_name(route: Route) -> str:
    """Its setter's name, else as the page says, such as "Red 3"."""
    return route.name or f"{(route.colour or 'route').capitalize()} {route.id}"

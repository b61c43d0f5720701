"""`routes.json`: groups of holds, with their names and figures."""

from __future__ import annotations

import msgspec

from walltopo.scans.document import Coordinate, Count, Document, Label, Rgb, Share


class Ambiguous(msgspec.Struct, frozen=True):
    """A hold that may belong to two routes: its probability by route id."""

    hold: Label
    routes: dict[str, Share]


class Route(msgspec.Struct, frozen=True):
    """One route.

    Lengths are world units: metres if `Scale.metric`. The file's keys are `length_m` and
    `largest_move_m`.

    Parameters
    ----------
    id : >= 1.
    name, grade, setter, description : from a setter, else empty.
    date : ISO date of setting (2026-03-01), from a setter, else empty.
    colour : the colour of its holds, or the setter's; colour_rgb : its sRGB.
    holds : ids from bottom to top (hand holds and footholds; volumes are in no list because
        they belong to every route).
    length : of the polyline from hand hold to hand hold.
    steepness_deg : mean wall angle under its holds.
    steepness_profile : (height above the lowest hold, degrees) per hand hold.
    largest_move : longest distance from a hand hold to the nearest lower one.
    holds_by_type : type to count.
    start, top : ids of the start (one or two holds) and of the last hold.
    zone : ids of the zone holds, from a setter.
    footholds : ids of holds for feet only: too small for hands, or marked so by a setter.
    doubtful_start, doubtful_top : why a person should check the hold; empty if it is certain.
    ambiguous : holds that may belong to two routes.
    proposed : whether walltopo proposed it and nobody has climbed it yet.
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
    """Return the setter's name of the route, else the page's, such as "Red 3"."""
    return route.name or f"{(route.colour or 'route').capitalize()} {route.id}"

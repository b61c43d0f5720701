"""`holds.json`: the table of holds that people and other programs read."""

from __future__ import annotations

import msgspec

from walltopo.scans.attributes import Hold, Point, Role
from walltopo.scans.bounds import Coordinate, Label, Rgb, Share
from walltopo.scans.document import Document
from walltopo.scans.routes import Route

__all__ = ["HoldRow", "Holds", "hold_rows"]


class HoldRow(msgspec.Struct, frozen=True):
    """One hold with its score and route; see `attributes.Hold` for the rest.

    Parameters
    ----------
    score : the lift's, in [0, 1].
    route : id of its route, None without one.
    """

    id: Label
    kind: str = msgspec.field(name="class")
    type: str
    colour: str
    colour_rgb: Rgb
    position: Point
    normal: Point
    size: Coordinate = msgspec.field(name="size_m")
    area: Coordinate = msgspec.field(name="area_m2")
    steepness_deg: Coordinate
    photos: tuple[str, ...]
    score: Share
    route: Label | None
    review: bool = False
    role: Role = "hold"


class Holds(Document, frozen=True, kw_only=True):
    """`holds.json`; `metric` tells whether its lengths are metres."""

    metric: bool
    holds: tuple[HoldRow, ...]


def hold_rows(
    holds: tuple[Hold, ...], scores: dict[int, float], routes: tuple[Route, ...]
) -> tuple[HoldRow, ...]:
    """The rows of `holds.json`, in the order of ids.

    Parameters
    ----------
    holds : the instances of `attributes.json`; scores : instance id to its score.
    routes : of `routes.json`; a hold on two routes is listed under the first.
    """
    route_of: dict[int, int] = {}
    for route in routes:
        for hold in route.holds:
            route_of.setdefault(hold, route.id)
    copied = set(HoldRow.__struct_fields__) - {"score", "route"}
    return tuple(
        HoldRow(
            **{name: getattr(hold, name) for name in copied},
            score=round(scores.get(hold.id, 0.0), 4),
            route=route_of.get(hold.id),
        )
        for hold in sorted(holds, key=lambda hold: hold.id)
    )

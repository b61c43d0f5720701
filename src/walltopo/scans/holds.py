"""`holds.json`: the table of holds that people and other programs read."""

from __future__ import annotations

from collections.abc import Collection

import msgspec

from walltopo.scans.attributes import Hold, Point, Role
from walltopo.scans.document import Coordinate, Document, Label, Rgb, Share, Unit
from walltopo.scans.routes import Route


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
    """`holds.json`.

    Parameters
    ----------
    metric : whether its lengths are metres.
    unit : scan units in a metre, as in `attributes.json`.
    """

    metric: bool
    unit: Unit = 1.0
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


# How a wall is put into words: the same in the terminal, the report and the page. The page's own
# rules are in `viewer/src/steepness.ts` and `viewer/src/words.ts`; a test of the viewer compares.
VERTICAL_DEG = 5  # whole degrees from upright that still are vertical


def steepness_words(degrees: float) -> str:
    """`vertical`, `12° overhang`, `8° slab`; positive degrees lean towards the climber."""
    whole = round(abs(degrees))
    if whole <= VERTICAL_DEG:
        return "vertical"
    return f"{whole}° {'overhang' if degrees > 0 else 'slab'}"


def _counted(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def count_words(routes: int, holds: Collection[HoldRow]) -> str:
    """`4 routes, 31 holds, 2 volumes`: a volume is no hold; without volumes they are not told."""
    volumes = sum(hold.kind == "volume" for hold in holds)
    parts = [_counted(routes, "route"), _counted(len(holds) - volumes, "hold")]
    if volumes:
        parts.append(_counted(volumes, "volume"))
    return ", ".join(parts)

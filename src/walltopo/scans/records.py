"""What is known of each hold and each route, and how it is written as JSON."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import InputError
from walltopo.scans.folder import read_json

__all__ = ["HAND_ROLES", "UNKNOWN", "Hold", "Route", "read_holds"]

Point = tuple[float, float, float]

# `hold` is climbed as part of one route; `volume` belongs to every route, `downclimb` to none.
UNKNOWN = "unknown"  # the colour or type of a hold that nothing tells
HAND_ROLES = ("hold", "volume", "downclimb")


def _triple(values: Any) -> Point:
    x, y, z = (float(v) for v in values)
    return x, y, z


def _rounded(values: Sequence[float], digits: int = 5) -> list[float]:
    return [round(float(v), digits) for v in values]


@dataclass(frozen=True)
class Hold:
    """One instance with its attributes; the entry of `attributes.json`.

    Parameters
    ----------
    id : the instance's id (>= 1).
    kind : "hold" or "volume", the detector's class.
    type : jug, crimp, ..., volume or "unknown".
    type_confidence, colour_confidence : 0 to 1.
    colour : a name of the palette, "unknown" where no photo shows the hold.
    colour_rgb : 0..255, the hold's own colour under the scan's mean light.
    position : world frame, metres; area centroid of the instance's surface.
    normal : unit, out of the wall.
    size_m : longest extent of the hold along the wall, metres.
    area_m2 : surface area of its triangles, square metres.
    steepness_deg : of the wall under it: 0 vertical, > 0 overhanging, < 0 slab.
    photos : names of the photos that show it, best first.
    role : one of `HAND_ROLES`.
    review : someone should have a look.
    maker : who made it, as a classifier tells; "" where none does.
    wall_tint : relative colour of the wall around it, RGB, mean 1 (`light.SceneLight.tint_at`).
    """

    id: int
    kind: str
    position: Point
    normal: Point = (0.0, -1.0, 0.0)
    type: str = "unknown"
    type_confidence: float = 0.0
    colour: str = "unknown"
    colour_rgb: tuple[int, int, int] = (128, 128, 128)
    colour_confidence: float = 0.0
    size_m: float = 0.0
    area_m2: float = 0.0
    steepness_deg: float = 0.0
    photos: tuple[str, ...] = ()
    role: str = "hold"
    review: bool = False
    maker: str = ""
    wall_tint: tuple[float, float, float] = (1.0, 1.0, 1.0)

    def __post_init__(self) -> None:
        if self.role not in HAND_ROLES:
            raise InputError(
                f"hold {self.id}: role must be one of {', '.join(HAND_ROLES)}, got {self.role!r}"
            )
        if not np.isfinite((*self.position, *self.normal)).all():
            raise InputError(f"hold {self.id}: position and normal must be finite")

    def to_json(self) -> dict[str, Any]:
        """The JSON object of `attributes.json`."""
        return {
            "id": self.id,
            "class": self.kind,
            "type": self.type,
            "type_confidence": round(self.type_confidence, 3),
            "colour": self.colour,
            "colour_rgb": list(self.colour_rgb),
            "colour_confidence": round(self.colour_confidence, 3),
            "position": _rounded(self.position),
            "normal": _rounded(self.normal),
            "size_m": round(self.size_m, 4),
            "area_m2": round(self.area_m2, 6),
            "steepness_deg": round(self.steepness_deg, 2),
            "photos": list(self.photos),
            "role": self.role,
            "review": self.review,
            "maker": self.maker,
            "wall_tint": _rounded(self.wall_tint, 4),
        }

    @classmethod
    def from_json(cls, entry: Mapping[str, Any]) -> Hold:
        """Read one entry of `attributes.json`; KeyError where a needed key is missing."""
        red, green, blue = (int(v) for v in entry["colour_rgb"])
        return cls(
            id=int(entry["id"]),
            kind=str(entry["class"]),
            position=_triple(entry["position"]),
            normal=_triple(entry["normal"]),
            type=str(entry["type"]),
            type_confidence=float(entry["type_confidence"]),
            colour=str(entry["colour"]),
            colour_rgb=(red, green, blue),
            colour_confidence=float(entry["colour_confidence"]),
            size_m=float(entry["size_m"]),
            area_m2=float(entry["area_m2"]),
            steepness_deg=float(entry["steepness_deg"]),
            photos=tuple(str(name) for name in entry["photos"]),
            role=str(entry["role"]),
            review=bool(entry["review"]),
            maker=str(entry.get("maker", "")),
            wall_tint=_triple(entry.get("wall_tint", (1.0, 1.0, 1.0))),
        )


def read_holds(path: Path) -> list[Hold]:
    """The holds of `attributes.json`.

    Raises
    ------
    InputError : the file is missing or broken; names the file and the entry.
    """
    data = read_json(path)
    if not isinstance(data, dict) or "instances" not in data:
        raise InputError(f"{path}: holds no `instances`", "Run the classify stage again.")
    holds = []
    for number, entry in enumerate(data["instances"]):
        try:
            holds.append(Hold.from_json(entry))
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: instance entry {number} is broken: {error!r}") from error
    return holds


@dataclass(frozen=True)
class Route:
    """One route.

    Parameters
    ----------
    id : >= 1.
    colour : the colour of its holds.
    holds : ids from bottom to top (hand holds and footholds; volumes are in no list because
        they belong to every route).
    name : given by a setter, else empty.
    start, top : ids of the likely start (one or two holds) and of the last hold.
    footholds : ids of holds too small for hands.
    ambiguous : hold id to its probability per route id, for holds that two routes could own.
    facts : figures for people: see `order.route_facts`.
    """

    id: int
    colour: str
    holds: tuple[int, ...]
    name: str = ""
    start: tuple[int, ...] = ()
    top: tuple[int, ...] = ()
    footholds: tuple[int, ...] = ()
    ambiguous: Mapping[int, Mapping[int, float]] = field(default_factory=dict)
    facts: Mapping[str, Any] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """The JSON object of `routes.json`."""
        return {
            "id": self.id,
            "name": self.name,
            "colour": self.colour,
            "holds": list(self.holds),
            **self.facts,
            "start": list(self.start),
            "top": list(self.top),
            "footholds": list(self.footholds),
            "ambiguous": [
                {"hold": hold, "routes": {str(k): round(p, 3) for k, p in shares.items()}}
                for hold, shares in self.ambiguous.items()
            ],
        }

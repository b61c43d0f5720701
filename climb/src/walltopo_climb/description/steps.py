"""The steps of a description: the start, each move, changes of the wall, the top."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Annotated, Final, Literal

import msgspec
import numpy as np
import numpy.typing as npt

from walltopo.core import InputError
from walltopo.scans.document import Coordinate, Label
from walltopo.scans.holds import Hold
from walltopo.scans.moves import ClimberRow, MoveRow
from walltopo.scans.routes import Route, route_name
from walltopo_climb.movement.on_wall import on_route, wall_normals
from walltopo_climb.movement.sequence import LIMBS

Floats = npt.NDArray[np.float64]

StepKind = Literal[
    "route", "start", "start_other", "start_with_both", "start_foot", "steepness", "hand", "match",
    "foot", "foot_off", "jump", "top", "out_of_reach",
]  # fmt: skip
MovingLimb = Literal["", "left_hand", "right_hand", "left_foot", "right_foot"]
Clock = Annotated[int, msgspec.Meta(ge=0, le=12)]

_STEEPNESS_DEG: Final = 10.0  # a smaller change of the wall is not mentioned
_SAME_PLACE: Final = 0.03  # m in the wall's plane: too close for a direction
_SMALL: Final = 0.06  # m: a smaller hold is called small
_LARGE: Final = 0.2  # m: a larger one is called large
_LIMBS: Final[tuple[MovingLimb, ...]] = ("left_hand", "right_hand", "left_foot", "right_foot")
_HANDS: Final = LIMBS[:2]


class Step(msgspec.Struct, frozen=True, kw_only=True):
    """One thing to say; a number that does not belong to the step is 0.

    Parameters
    ----------
    kind : decides the sentence.
    limb : the moving limb.
    hold : id of the hold; hold_type : jug, crimp, ..., "unknown"; size : small, medium or large.
    clock : direction in the wall's plane as on a clock's face, 12 is up; 0: none.
    distance : m, from `origin`; `distance_m` in the file.
    origin : the limb from whose place direction and distance count.
    height : m above the floor (z = 0) of the hold; `height_m` in the file.
    apart : m between both hands; `apart_m` in the file.
    beyond : m beyond reach; `beyond_m` in the file.
    steepness_deg : of the wall; > 0 overhangs.
    name : of the route. hands, moves : numbers of hand holds and of the hands' moves.
    """

    kind: StepKind
    limb: MovingLimb = ""
    hold: Label = 0
    hold_type: str = "unknown"
    size: Literal["small", "medium", "large"] = "medium"
    clock: Clock = 0
    distance: Coordinate = msgspec.field(name="distance_m", default=0.0)
    origin: MovingLimb = ""
    height: Coordinate = msgspec.field(name="height_m", default=0.0)
    apart: Coordinate = msgspec.field(name="apart_m", default=0.0)
    beyond: Coordinate = msgspec.field(name="beyond_m", default=0.0)
    steepness_deg: Coordinate = 0.0
    name: str = ""
    hands: int = 0
    moves: int = 0


def route_steps(
    route: Route, row: ClimberRow, holds: Sequence[Hold], unit: float
) -> tuple[Step, ...]:
    """Return the steps of a route as a body climbs it.

    Parameters
    ----------
    row : the body's moves, of `climber_rows` or of `moves.json`.
    holds : all holds of the wall. unit : scan units per metre.

    Raises
    ------
    InputError : the body cannot reach the start.
    """
    if not row.moves:
        raise InputError(
            f"the start of {route_name(route)} is out of reach at a height of {row.height:.2f} m"
        )
    used = on_route(route, holds, unit)
    places = np.array([hold.position for hold in used]) / unit
    normals = wall_normals(
        places,
        np.array([hold.normal for hold in used]),
        np.array([hold.steepness_deg for hold in used]),
    )
    at = {
        hold.id: _Spot(place, normal, hold)
        for hold, place, normal in zip(used, places, normals, strict=True)
    }
    writer = _Writer(at, unit)
    writer.start(route, row)
    for before, move in pairwise(row.moves):
        writer.move(before, move)
    writer.end(row)
    return tuple(writer.steps)


@dataclass(frozen=True)
class _Spot:
    """The place of a hold, (3,) m, the (3,) normal of the wall under it, and the hold."""

    place: Floats
    normal: Floats
    hold: Hold


@dataclass
class _Writer:
    """Collects the steps of one climb."""

    at: Mapping[int, _Spot]
    unit: float
    steps: list[Step] = field(default_factory=list)
    steepness: float = 0.0

    def start(self, route: Route, row: ClimberRow) -> None:
        """Add the route and the start."""
        first = row.moves[0]
        left, right, *feet = first.holds
        self.steepness = self.at[left].hold.steepness_deg
        for_feet = set(route.footholds)
        self.steps.append(
            Step(
                kind="route",
                name=route_name(route),
                hands=len([hold for hold in route.holds if hold not in for_feet]),
                moves=sum(move.limb in _HANDS for move in row.moves),
                height=max(self._height(hand) for move in row.moves for hand in move.holds[:2]),
                steepness_deg=round(self.steepness),
            )
        )
        if left == right:
            self.steps.append(self._on("start_with_both", left))
        else:
            apart = self._distance(left, right)
            self.steps.append(self._on("start", left, limb="left_hand"))
            self.steps.append(self._on("start_other", right, limb="right_hand", apart=apart))
        for limb, hold in zip(_LIMBS[2:], feet, strict=True):
            if hold:
                self.steps.append(self._on("start_foot", hold, limb=limb))

    def move(self, before: MoveRow, move: MoveRow) -> None:
        """Add a move, and before it the change of the wall."""
        limb = LIMBS.index(move.limb)
        hold = move.holds[limb]
        if not hold:
            self.steps.append(Step(kind="foot_off", limb=_LIMBS[limb]))
            return
        is_hand = move.limb in _HANDS
        steepness = self.at[hold].hold.steepness_deg
        if is_hand and abs(steepness - self.steepness) >= _STEEPNESS_DEG:
            self.steepness = steepness
            self.steps.append(Step(kind="steepness", steepness_deg=round(steepness)))
        if is_hand and hold == before.holds[limb ^ 1]:
            self.steps.append(self._on("match", hold, limb=_LIMBS[limb]))
            return
        origin = self._origin(before.holds, limb, hold)
        clock, distance = self._direction(before.holds[origin], hold)
        self.steps.append(
            self._on(
                "foot" if not is_hand else "jump" if move.beyond > 0 else "hand",
                hold,
                limb=_LIMBS[limb],
                clock=clock,
                distance=distance,
                origin=_LIMBS[origin],
                beyond=move.beyond,
            )
        )

    def end(self, row: ClimberRow) -> None:
        """Add the top, or that the rest is out of reach."""
        highest = max(row.moves[-1].holds[:2], key=self._height)
        self.steps.append(self._on("top" if row.reached else "out_of_reach", highest))

    def _origin(self, held: Sequence[int], limb: int, to: int) -> int:
        """Return the limb from whose hold a move is described, because directions are coarse.

        It is the moving limb or the one beside it, whichever is nearer to the new hold; the hand of
        the same side for a foot while both feet are on none.
        """
        others = [one for one in (limb, limb ^ 1) if held[one]] or [limb % 2]
        return min(others, key=lambda one: self._distance(held[one], to))

    def _on(self, kind: StepKind, number: int, **more: object) -> Step:
        """Return a step on a hold."""
        hold = self.at[number].hold
        size = hold.size / self.unit
        step = Step(
            kind=kind,
            hold=number,
            hold_type="volume" if hold.kind == "volume" else hold.type,
            size="small" if size < _SMALL else "large" if size > _LARGE else "medium",
            height=self._height(number),
        )
        return msgspec.structs.replace(step, **more)

    def _height(self, number: int) -> float:
        return float(self.at[number].place[2])

    def _distance(self, one: int, other: int) -> float:
        return float(np.linalg.norm(self.at[one].place - self.at[other].place))

    def _direction(self, start: int, end: int) -> tuple[int, float]:
        """Return the hour of the clock (0: none) and the distance in metres between two holds."""
        way = self.at[end].place - self.at[start].place
        right, up = wall_axes(self.at[start].normal)
        across, along = float(way @ right), float(way @ up)
        if np.hypot(across, along) < _SAME_PLACE:
            return 0, float(np.linalg.norm(way))
        hour = round(np.degrees(np.arctan2(across, along)) / 30) % 12
        return hour or 12, float(np.linalg.norm(way))


def wall_axes(normal: Floats) -> tuple[Floats, Floats]:
    """Return the unit vectors right and up in the wall's plane, of a climber who faces the wall.

    Parameters
    ----------
    normal : (3,) unit, out of the wall. Under a flat roof, up is the direction out of the roof;
        with no heading at all it is y.
    """
    up = np.array([0.0, 0.0, 1.0]) - normal[2] * normal
    length = float(np.linalg.norm(up))
    up = up / length if length > 1e-6 else np.array([0.0, 1.0, 0.0])
    return np.cross(up, normal), up

"""The sequences that climbers confirmed, together; shown from three climbers on."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Final, Literal
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.beta.orders import order_difference
from walltopo_gym.clips.models import Clip
from walltopo_gym.clips.service import attempt_in
from walltopo_gym.publishing.models import Placement, Route
from walltopo_gym.publishing.version_holds import current_holds, version_holds
from walltopo_gym.storage.files import FileStore
from walltopo_gym.walls.models import Wall

MIN_CLIMBERS: Final = 3
_MAX_ORDERS: Final = 3
_ALIKE: Final = 0.1  # of ten moves one may differ: so much people forget to correct
_HANDS: Final[Mapping[str, Hand]] = {"left hand": "left", "right hand": "right"}

Hand = Literal["left", "right"]
Order = tuple[tuple[Hand, int], ...]  # hand and hold


@dataclass(frozen=True)
class HandOrder:
    """An order of hands, and the number of climbers who used it or one much like it."""

    order: Order
    climbers: int


@dataclass(frozen=True)
class RouteBeta:
    """How climbers climb a route.

    Parameters
    ----------
    climbers : how many confirmed a sequence. holds : of the route, the lowest first.
    used : hold to number of climbers. orders : the most used first.
    ends : hold of the last hand to number of attempts, without tops; tops : attempts at the top.
    """

    climbers: int
    holds: list[int]
    used: Mapping[int, int]
    orders: list[HandOrder]
    ends: Mapping[int, int]
    tops: int


def beta_of(session: Session, store: FileStore, route: Route) -> RouteBeta | None:
    """Return how climbers climb a route, with the holds of the wall's published version; None with
    fewer than three climbers, or without a published version that shows the route."""
    wall = session.get_one(Wall, route.wall_id)
    placed = select(Placement.holds).where(
        Placement.route_id == route.id, Placement.scan_id == wall.published_scan_id
    )
    holds = session.scalar(placed)
    confirmed = select(Clip).where(Clip.route_id == route.id, Clip.moves.is_not(None))
    clips = session.scalars(confirmed.order_by(Clip.created_at, Clip.id)).all()
    climbers = {clip.person_id for clip in clips}
    if holds is None or wall.published_scan_id is None or len(climbers) < MIN_CLIMBERS:
        return None
    heights = version_holds(store, wall.published_scan_id).by_id
    current = {
        scan: current_holds(session, store, wall, scan) for scan in {clip.scan_id for clip in clips}
    }
    summary = summarise([(clip, current[clip.scan_id]) for clip in clips])
    upwards = sorted(holds, key=lambda hold: heights[hold].position[2])
    return RouteBeta(len(climbers), upwards, *summary)


def summarise(
    clips: Sequence[tuple[Clip, Mapping[int, int]]],
) -> tuple[Mapping[int, int], list[HandOrder], Mapping[int, int], int]:
    """Return the last four fields of a `RouteBeta`.

    Parameters
    ----------
    clips : confirmed ones, each with the published id of the holds of its version.
    """
    used: dict[int, set[UUID]] = defaultdict(set)
    orders: dict[Order, set[UUID]] = defaultdict(set)
    ends = Counter[int]()
    tops = 0
    for clip, current in clips:
        moves = clip.moves or []
        for hold in {current[move["hold"]] for move in moves if move["hold"] in current}:
            used[hold].add(clip.person_id)
        order = _order_of(
            (_HANDS[move["limb"]], current[move["hold"]])
            for move in moves
            if move["limb"] in _HANDS and move["hold"] in current
        )
        if not order:
            continue
        orders[order].add(clip.person_id)
        attempt = attempt_in(clip)
        if attempt is not None and attempt.top is not None:
            tops += 1
        else:
            ends[order[-1][1]] += 1
    return {hold: len(people) for hold, people in used.items()}, _common_orders(orders), ends, tops


def _common_orders(orders: Mapping[Order, set[UUID]]) -> list[HandOrder]:
    """Return the most used orders; one that is like a more used one counts there."""
    groups: dict[Order, set[UUID]] = {}
    for order, people in sorted(orders.items(), key=lambda item: (-len(item[1]), item[0])):
        alike = (one for one in groups if order_difference(one, order) <= _ALIKE)
        like = next(alike, order)
        groups[like] = groups.get(like, set()) | people
    ranked = sorted(groups.items(), key=lambda item: (-len(item[1]), item[0]))
    return [HandOrder(order, len(people)) for order, people in ranked[:_MAX_ORDERS]]


def _order_of(hands: Iterable[tuple[Hand, int]]) -> Order:
    """Return the moves of the hands; a hand that takes the same hold again makes no move."""
    return tuple(move for move, _ in groupby(hands))

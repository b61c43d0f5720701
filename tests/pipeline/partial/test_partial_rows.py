"""Ids, routes and edits of a partial rescan."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np
from tests.pipeline.partial.partial_walls import Wall

from walltopo.pipeline.partial.rows import (
    Tables,
    carried_edits,
    join_tables,
    last_id,
    renumbered,
)
from walltopo.scans.edits import Add, EditLog, Join, Paint, Ref, SetHold, SetRoute
from walltopo.scans.holds import Hold, Holds
from walltopo.scans.instances import InstanceRecord
from walltopo.scans.routes import Route, Routes

GRID = {number: (0.3 + 0.4 * (number % 8), 0.4 + 0.4 * (number // 8), 0.05) for number in range(32)}


def _tables(
    holds: list[Hold], routes: dict[int, tuple[int, ...]], present: Collection[int]
) -> Tables:
    known = {hold.id for hold in holds}
    records = tuple(
        InstanceRecord(
            id=h.id,
            label=1,
            kind="hold",
            score=0.9,
            votes={"1": 1.0},
            views=(("a.jpg", 0),),
            faces=9,
        )
        for h in holds
    )
    rows = tuple(Route(id=number, colour="red", holds=own) for number, own in routes.items())
    assert known >= {hold for own in routes.values() for hold in own}
    return Tables(
        frozenset(present),
        Holds(metric=True, holds=tuple(holds)),
        Routes(routes=rows),
        records,
        max(known),
    )


def _old() -> Tables:
    rows = Wall(holds={number + 1: place for number, place in GRID.items()}).rows()
    routes = {1: tuple(range(1, 9)), 2: tuple(range(9, 17)), 3: tuple(range(17, 25))}
    return _tables(rows, routes, range(9, 33))  # the lowest row was photographed


def _new() -> Tables:
    """Six of the lowest row unchanged, two moved away, one added."""
    places = {10 + k: GRID[k] for k in range(6)} | {40: (1.1, 0.2, 0.05), 41: (2.0, 0.2, 0.05)}
    rows = Wall(holds=places).rows()
    return _tables(rows, {1: (*range(10, 16), 40), 2: (41,)}, places)


def test_unchanged_holds_keep_their_ids_and_new_ones_get_unused_ids() -> None:
    joined = join_tables(_old(), _new(), {"a.jpg": "2-a.jpg"}, {"a.jpg"})
    assert joined.same == frozenset(range(1, 7))
    assert joined.gone == {7, 8}
    assert joined.added == {33, 34}
    assert joined.number_of == {10 + k: 1 + k for k in range(6)} | {40: 33, 41: 34}
    assert [hold.id for hold in joined.holds.holds] == [*range(1, 7), *range(9, 35)]


def test_what_was_not_photographed_is_exactly_as_before() -> None:
    old = _old()
    joined = join_tables(old, _new(), {"a.jpg": "2-a.jpg"}, {"a.jpg"})
    after = {hold.id: hold for hold in joined.holds.holds}
    assert all(after[hold.id] == hold for hold in old.holds.holds if hold.id > 8)
    routes = {route.id: route for route in joined.routes.routes}
    assert all(routes[number] == old.routes.routes[number - 1] for number in (2, 3))


def test_new_holds_join_the_route_of_their_unchanged_neighbours_or_begin_one() -> None:
    joined = join_tables(_old(), _new(), {"a.jpg": "2-a.jpg"}, {"a.jpg"})
    routes = {route.id: set(route.holds) for route in joined.routes.routes}
    assert routes[1] == {*range(1, 7), 33}
    assert routes[4] == {34}
    assert joined.routes.unrouted == tuple(range(25, 33))


def test_a_route_whose_holds_are_gone_is_gone() -> None:
    new = _tables(Wall(holds={1: (1.0, 0.1, 0.05)}).rows(), {}, {1})
    joined = join_tables(_old(), new, {}, {"a.jpg"})
    assert [route.id for route in joined.routes.routes] == [2, 3]
    assert joined.gone == frozenset(range(1, 9))


def test_photos_get_their_joined_names() -> None:
    joined = join_tables(_old(), _new(), {"a.jpg": "2-a.jpg"}, ())
    photos = {hold.id: hold.photos for hold in joined.holds.holds}
    assert photos[1] == photos[33] == ("2-a.jpg",)
    assert photos[9] == ()
    records = {row.id: row.views for row in joined.records}
    assert records[33] == (("2-a.jpg", 0),)


def test_labels_get_the_joined_ids() -> None:
    labels = np.array([0, 10, 41, 12], dtype=np.int32)
    assert renumbered(labels, {10: 1, 41: 34}).tolist() == [0, 1, 34, 0]


def test_edits_of_what_is_gone_are_left_out_and_no_place_misleads_the_others() -> None:
    here, there = (0.3, 0.0, 0.4), (3.0, 0.0, 1.0)
    log = EditLog(
        edits=(
            SetHold(hold=Ref(1, here), colour="blue"),
            SetHold(hold=Ref(7, here), colour="green"),
            SetRoute(route=Ref(1, here), name="Moon"),
            Add(hold=Ref(40, here)),
            Add(hold=Ref(41, there)),
            Paint(hold=Ref(9, there), at=here, radius_m=0.1),
            Join(holds=(Ref(7), Ref(8), Ref(9))),
        )
    )
    carried = carried_edits(log, {7, 8}, lambda place: place == here)
    assert carried.edits == (
        SetHold(hold=Ref(1), colour="blue"),
        SetRoute(route=Ref(1), name="Moon"),
        Add(hold=Ref(41, there)),
        Join(holds=(Ref(9),)),
    )


def test_ids_that_only_the_log_used_are_not_used_again() -> None:
    holds = Holds(metric=True, holds=tuple(Wall(holds={3: (1.0, 1.0, 0.1)}).rows()))
    log = EditLog(edits=(Add(hold=Ref(17, (0.0, 0.0, 0.0))),))
    assert last_id(np.array([0, 3, 5], dtype=np.int32), holds, log) == 17

"""Routes of two scans are matched, on walls of random holds."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from msgspec.structs import replace as changed

from walltopo.describe.matching.routes import RouteMatch, RouteStatus, compare_routes
from walltopo.scans.holds import Hold


def hold(number: int, x: float, z: float, *, colour: str = "red", size: float = 0.1) -> Hold:
    """A hold on a vertical wall, at metres from its left foot."""
    return Hold(id=number, kind="hold", colour=colour, position=(x, 0.0, z), size=size)


COLOURS = ("red", "blue", "green", "yellow")


def wall(routes: int, seed: int) -> tuple[dict[int, list[int]], list[Hold]]:
    """Routes of seven holds each, beside each other, at least 30 cm apart."""
    rng = np.random.default_rng(seed)
    holds: list[Hold] = []
    made: dict[int, list[int]] = {}
    for number in range(1, routes + 1):
        ids = range(len(holds) + 1, len(holds) + 8)
        made[number] = list(ids)
        for k, own in enumerate(ids):
            x, z = rng.uniform(-0.05, 0.05, 2) + (0.8 * number, 0.4 * k + 0.3)
            colour = COLOURS[number % 4]
            holds.append(hold(own, x, z, colour=colour, size=float(rng.uniform(0.06, 0.2))))
    return made, holds


@given(st.integers(1, 8), st.sets(st.integers(1, 8)), st.integers(0, 2**16), st.floats(-0.08, 0.08))
def test_what_stays_is_kept_whatever_its_number_and_the_drift(
    routes: int, gone: set[int], seed: int, drift: float
) -> None:
    """Some routes go, the rest is scanned again: renumbered, shuffled, shifted as a whole."""
    old_routes, old = wall(routes, seed)
    staying = [number for number in old_routes if number not in gone]
    rng = np.random.default_rng(seed)
    renumbered = {int(n): k for k, n in enumerate(rng.permutation(staying), start=1)}
    ids = {own: 1000 - own for number in staying for own in old_routes[number]}
    new = [
        changed(h, id=ids[h.id], position=(h.position[0] + drift, h.position[1], h.position[2]))
        for h in old
        if h.id in ids
    ]
    new_routes = {renumbered[n]: [ids[own] for own in old_routes[n]] for n in staying}
    lines = compare_routes(old_routes, old, new_routes, new)
    assert {line.number: line.route for line in lines if line.number is not None} == {
        renumbered[n]: n for n in staying
    }
    fates = {line.route: line.status for line in lines}
    assert {n for n, fate in fates.items() if fate == RouteStatus.STRIPPED} == set(
        old_routes
    ) - set(staying)
    assert RouteStatus.NEW not in fates.values()


@given(st.integers(1, 6), st.integers(0, 2**16))
def test_another_wall_keeps_nothing(routes: int, seed: int) -> None:
    """New routes at new places; the old ones are all stripped."""
    old_routes, old = wall(routes, seed)
    new = [changed(h, position=(h.position[0] + 0.4, 0.0, h.position[2] + 0.2)) for h in old]
    lines = compare_routes(old_routes, old, old_routes, new)
    assert {line.status for line in lines} == {RouteStatus.NEW, RouteStatus.STRIPPED}


def test_another_colour_at_the_same_places_is_another_route() -> None:
    routes, old = wall(1, 0)
    new = [changed(h, colour="black", colour_rgb=(30, 30, 30)) for h in old]
    assert [line.status for line in compare_routes(routes, old, routes, new)] == [
        RouteStatus.NEW,
        RouteStatus.STRIPPED,
    ]


def test_a_shade_between_two_names_may_bear_either() -> None:
    routes, old = wall(1, 0)
    new = [changed(h, colour="pink", colour_rgb=(140, 120, 128)) for h in old]
    assert [line.status for line in compare_routes(routes, old, routes, new)] == [RouteStatus.KEPT]


@pytest.mark.parametrize(
    ("taken", "fate"), [(0, RouteStatus.KEPT), (2, RouteStatus.CHANGED), (5, RouteStatus.NEW)]
)
def test_a_route_without_some_holds(taken: int, fate: RouteStatus) -> None:
    routes, old = wall(1, 1)
    new = old[taken:]
    lines: list[RouteMatch[int]] = compare_routes(routes, old, {4: [h.id for h in new]}, new)
    assert lines[0].status == fate
    if fate == RouteStatus.CHANGED:
        assert lines[0] == RouteMatch(
            RouteStatus.CHANGED, 1, 4, removed=tuple(h.id for h in old[:taken])
        )


def test_a_hold_that_was_moved_is_reported() -> None:
    routes, old = wall(2, 2)
    x, y, z = old[3].position
    new = [*old[:3], changed(old[3], position=(x, y, z + 0.07)), *old[4:]]
    kept, whole = compare_routes(routes, old, routes, new)
    assert kept == RouteMatch(RouteStatus.CHANGED, 1, 1, moved=(4,))
    assert whole == replace(kept, status=RouteStatus.KEPT, route=2, number=2, moved=())


def test_an_empty_wall_and_no_scan_before() -> None:
    routes, holds = wall(1, 3)
    none: dict[int, list[int]] = {}
    assert [line.status for line in compare_routes(none, (), routes, holds)] == [RouteStatus.NEW]
    assert [line.status for line in compare_routes(routes, holds, none, ())] == [
        RouteStatus.STRIPPED
    ]
    assert compare_routes(none, (), none, ()) == []

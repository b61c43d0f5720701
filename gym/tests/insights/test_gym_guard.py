"""Published sums reveal nothing about fewer than five people, by any sums and differences."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from walltopo_gym.insights.guard import People, Style, safe_to_show
from walltopo_gym.insights.usage import ENOUGH

ROUTES = [str(n) for n in range(10)]
VALUES = {
    "steepness": ("slab", "vertical", "roof"),
    "colour": ("red", "blue", "green"),
    "length": ("short", "long", ""),
}


@st.composite
def halls(draw: st.DrawFn) -> tuple[dict[Style, frozenset[str]], People]:
    """Styles of ten routes, and who of two or three groups has tried which."""
    routes = ROUTES[: draw(st.integers(2, 10))]
    styles: dict[Style, set[str]] = {}
    for kind, values in VALUES.items():
        for route in routes:
            value = draw(st.sampled_from(values))
            if value:
                styles.setdefault(Style(kind, value), set()).add(route)
    people: dict[str, dict[str, frozenset[int]]] = {}
    for group in range(draw(st.integers(2, 3))):
        # Some routes are tried by all of a group, some by few, some by nobody.
        members = range(100 * group, 100 * group + draw(st.integers(5, 9)))
        people[str(group)] = {
            route: frozenset(
                draw(
                    st.one_of(
                        st.just(set(members)), st.sets(st.sampled_from(members)), st.just(set())
                    )
                )
            )
            for route in routes
        }
    return {style: frozenset(of) for style, of in styles.items()}, people


def behind(people: People, group: str, routes: frozenset[str]) -> int:
    return len(frozenset[int]().union(*(people[group].get(route, frozenset()) for route in routes)))


def small(people: People, routes: frozenset[str]) -> bool:
    return any(0 < behind(people, group, routes) < ENOUGH for group in people)


@settings(max_examples=150, deadline=None)
@given(hall=halls())
def test_no_group_of_under_five_is_found_out(
    hall: tuple[dict[Style, frozenset[str]], People],
) -> None:
    styles, people = hall
    answer = safe_to_show(styles, people)
    everything = frozenset(route for of in people.values() for route in of)
    known = {style: styles[style] & everything for style in answer}
    for routes in known.values():
        assert not small(people, routes)
    # "All of a group, but these": of each number of styles of a kind.
    for kind in VALUES:
        mine = [routes for style, routes in known.items() if style.kind == kind]
        for size in range(1, len(mine) + 1):
            for some in combinations(mine, size):
                assert not small(people, everything.difference(*some))
    # One sum taken from another, and from two together.
    for one, other in combinations([everything, *known.values()], 2):
        for large, little in ((one, other), (other, one)):
            if little < large and answer:
                assert not small(people, large - little)
    # A single route, by whatever equations.
    order = sorted(everything)
    rows = np.array([[r in of for r in order] for of in (everything, *known.values())], float)
    for at, route in enumerate(order):
        unit = np.eye(len(order))[at]
        found = np.linalg.lstsq(rows.T, unit, rcond=None)[0]
        if answer and np.allclose(rows.T @ found, unit, atol=1e-6):
            assert not small(people, frozenset([route]))


def test_a_subtraction_is_seen() -> None:
    """Red is slab and one route more, which one person of a group has tried."""
    many = frozenset(range(8))
    slab, alone, rest = ROUTES[:3], ROUTES[3], ROUTES[4:]
    styles = {
        Style("steepness", "slab"): frozenset(slab),
        Style("steepness", "roof"): frozenset([alone, *rest]),
        Style("colour", "red"): frozenset([*slab, alone]),
        Style("colour", "blue"): frozenset(rest),
    }
    everybody = dict.fromkeys(ROUTES, many)
    people = {"a": everybody | {alone: frozenset([1])}, "b": everybody}
    answer = safe_to_show(styles, people)
    assert answer
    assert len({style.kind for style in answer}) == 1
    assert safe_to_show(styles, {"a": everybody, "b": everybody}) == set(styles)


def test_a_style_of_few_takes_another_one_with_it() -> None:
    many = frozenset(range(8))
    styles = {Style("colour", str(n)): frozenset([route]) for n, route in enumerate(ROUTES[:4])}
    people = {
        "a": dict.fromkeys(ROUTES[:3], many) | {ROUTES[3]: frozenset([1, 2])},
        "b": dict.fromkeys(ROUTES[:4], many),
    }
    assert len(safe_to_show(styles, people)) == 2

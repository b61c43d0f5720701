"""Decide which sums over groups may be published, so that no group under five people is exposed.

Sums are published by style (a set of routes) and group. A reader also knows the total of each route
(its page shows it), the total of each group, and can subtract sums from each other. So a style is
published for all groups or for none, and only if

1. each group of it has no person or at least `ENOUGH` people; 2. the same holds for the routes that
the styles of one kind leave over ("all but these"); 3. the same holds for each piece (routes that
are in the same styles) that the sums determine: its row lies in the row space of the sums, found by
projection; 4. the same holds for each set of routes that up to three sums, added and subtracted,
amount to.

Because a style is published for all of two or more groups, or for none, a route's total over all
groups adds nothing: the share of one group in it is unknown.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import combinations, product
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from walltopo_gym.insights.usage import ENOUGH

_CLOSE: Final = 1e-7
# By group and route (any key as text): who is behind what is counted there.
People = Mapping[str, Mapping[str, frozenset[int]]]


class Style(NamedTuple):
    """A value of a kind of style, such as ("steepness", "slab")."""

    kind: str
    value: str


def safe_to_show(styles: Mapping[Style, frozenset[str]], people: People) -> set[Style]:
    """Return the styles whose sums by group may be published.

    Parameters
    ----------
    styles : with their routes; those of one kind share none.
    people : groups that have no person in common.
    """
    shown = {style for style, routes in styles.items() if _is_safe(people, routes)}
    whole = frozenset(route for routes in people.values() for route in routes)
    while (left := _first_left_over(shown, styles, people, whole)) or (
        left := _first_found_out(shown, styles, people, whole)
    ):
        shown.remove(min(left, key=lambda style: (_min_group_size(people, styles[style]), style)))
    return shown


def _is_safe(people: People, routes: Iterable[str]) -> bool:
    return _min_group_size(people, routes) >= ENOUGH


def _min_group_size(people: People, routes: Iterable[str]) -> int:
    """Return the size of the smallest non-empty group; `ENOUGH` without one."""
    found = list(routes)
    sizes = [
        len(frozenset[int]().union(*(of.get(route, frozenset()) for route in found)))
        for of in people.values()
    ]
    return min((size for size in sizes if size), default=ENOUGH)


def _first_left_over(
    shown: set[Style],
    styles: Mapping[Style, frozenset[str]],
    people: People,
    whole: frozenset[str],
) -> list[Style]:
    """Apply rule 2: return the styles of a kind that leave too few people over."""
    for kind in sorted({style.kind for style in shown}):
        mine = [style for style in shown if style.kind == kind]
        if not _is_safe(people, whole.difference(*(styles[style] for style in mine))):
            return mine
    return []


def _first_found_out(
    shown: set[Style],
    styles: Mapping[Style, frozenset[str]],
    people: People,
    whole: frozenset[str],
) -> list[Style]:
    """Apply rules 3 and 4: return styles one of which must go, so that a set of routes stays
    hidden."""
    order = sorted(shown)
    pieces = _inseparable_sets(order, styles, whole)
    rows = np.array([[style in of for of in pieces] for style in order], np.int8)
    rows = np.vstack([np.ones(len(pieces), np.int8), rows.reshape(len(order), len(pieces))])
    for found in (*_determined_pieces(rows), *_differences_of_sums(rows)):
        routes = [route for at in found for route in pieces[list(pieces)[at]]]
        if not _is_safe(people, routes):
            return [style for style in order if not styles[style].isdisjoint(routes)] or order
    return []


def _inseparable_sets(
    shown: Sequence[Style], styles: Mapping[Style, frozenset[str]], whole: frozenset[str]
) -> dict[frozenset[Style], list[str]]:
    """Return the sets of routes that no sum separates."""
    pieces: dict[frozenset[Style], list[str]] = {}
    for route in whole:
        of = frozenset(style for style in shown if route in styles[style])
        pieces.setdefault(of, []).append(route)
    return pieces


def _determined_pieces(rows: NDArray[np.int8]) -> list[list[int]]:
    """Return the single pieces whose sums follow from the others."""
    _, sizes, basis = np.linalg.svd(rows.astype(float), full_matrices=False)
    basis = basis[sizes > _CLOSE * sizes.max(initial=1.0)]
    # The part of each unit vector that lies in the row space; all of it: it is determined.
    inside = (basis**2).sum(axis=0)
    return [[int(at)] for at in np.flatnonzero(inside > 1 - _CLOSE)]


def _differences_of_sums(rows: NDArray[np.int8]) -> list[list[int]]:
    """Return the sets of pieces that two or three sums, added and subtracted, amount to."""
    found: set[tuple[int, ...]] = set()
    for size in (2, 3):
        chosen = np.array(list(combinations(range(len(rows)), size)), int).reshape(-1, size)
        for signs in product((1, -1), repeat=size):
            sums = sum(sign * rows[chosen[:, k]] for k, sign in enumerate(signs))
            flat = np.asarray(sums).reshape(len(chosen), rows.shape[1])
            is_set = ((flat == 0) | (flat == 1)).all(axis=1) & flat.any(axis=1)
            found |= {tuple(np.flatnonzero(row).tolist()) for row in flat[is_set]}
    return [list(one) for one in sorted(found)]

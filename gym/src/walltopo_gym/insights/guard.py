"""Which sums over groups of people may be told, so that no group of under five is told of.

Sums are told by style (a set of routes) and group. Whoever reads them knows more: what each route
comes to over all groups (its page says so), what a group comes to over all routes, and that sums
can be taken from each other. So a style is told for all groups or for none, and is told only where

1. in each group nobody or at least `ENOUGH` people are behind it;
2. so are behind what the styles of the same kind leave over, which "all but these" comes to;
3. so are behind each piece (routes that are in the same styles) that the sums determine: one whose
   row lies in the row space of the sums, found by projection;
4. so are behind each set of routes that up to three sums, added and taken away, come to.

As a style is told for all of two groups or more, or for none, knowing each route's total over all
groups adds nothing: what one group of a piece has more, another may have less.
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


def may_be_told(styles: Mapping[Style, frozenset[str]], people: People) -> set[Style]:
    """The styles whose sums by group may be told.

    Parameters
    ----------
    styles : with their routes; those of one kind share none.
    people : groups that have no person in common.
    """
    told = {style for style, routes in styles.items() if _is_safe(people, routes)}
    whole = frozenset(route for routes in people.values() for route in routes)
    while (left := _first_left_over(told, styles, people, whole)) or (
        left := _first_found_out(told, styles, people, whole)
    ):
        told.remove(min(left, key=lambda style: (_fewest(people, styles[style]), style)))
    return told


def _is_safe(people: People, routes: Iterable[str]) -> bool:
    return _fewest(people, routes) >= ENOUGH


def _fewest(people: People, routes: Iterable[str]) -> int:
    """Of the groups that have somebody there: how many the smallest has; `ENOUGH` for none."""
    found = list(routes)
    sizes = [
        len(frozenset[int]().union(*(of.get(route, frozenset()) for route in found)))
        for of in people.values()
    ]
    return min((size for size in sizes if size), default=ENOUGH)


def _first_left_over(
    told: set[Style], styles: Mapping[Style, frozenset[str]], people: People,
    whole: frozenset[str],
) -> list[Style]:  # fmt: skip
    """Rule 2: the styles of a kind of which too few are left over."""
    for kind in sorted({style.kind for style in told}):
        mine = [style for style in told if style.kind == kind]
        if not _is_safe(people, whole.difference(*(styles[style] for style in mine))):
            return mine
    return []


def _first_found_out(
    told: set[Style], styles: Mapping[Style, frozenset[str]], people: People,
    whole: frozenset[str],
) -> list[Style]:  # fmt: skip
    """Rules 3 and 4: styles of which one has to go, so that a set of routes is not found out."""
    order = sorted(told)
    pieces = _pieces(order, styles, whole)
    rows = np.array([[style in of for of in pieces] for style in order], np.int8)
    rows = np.vstack([np.ones(len(pieces), np.int8), rows.reshape(len(order), len(pieces))])
    for found in (*_determined(rows), *_differences(rows)):
        routes = [route for at in found for route in pieces[list(pieces)[at]]]
        if not _is_safe(people, routes):
            return [style for style in order if not styles[style].isdisjoint(routes)] or order
    return []


def _pieces(
    told: Sequence[Style], styles: Mapping[Style, frozenset[str]], whole: frozenset[str]
) -> dict[frozenset[Style], list[str]]:
    """Routes that no sum tells apart, by the styles that they are in."""
    pieces: dict[frozenset[Style], list[str]] = {}
    for route in whole:
        of = frozenset(style for style in told if route in styles[style])
        pieces.setdefault(of, []).append(route)
    return pieces


def _determined(rows: NDArray[np.int8]) -> list[list[int]]:
    """Single pieces whose sum follows from the others."""
    _, sizes, basis = np.linalg.svd(rows.astype(float), full_matrices=False)
    basis = basis[sizes > _CLOSE * sizes.max(initial=1.0)]
    # The part of each unit vector that lies in the row space; all of it: it is determined.
    inside = (basis**2).sum(axis=0)
    return [[int(at)] for at in np.flatnonzero(inside > 1 - _CLOSE)]


def _differences(rows: NDArray[np.int8]) -> list[list[int]]:
    """Sets of pieces that two or three sums, added and taken away, come to."""
    found: set[tuple[int, ...]] = set()
    for size in (2, 3):
        chosen = np.array(list(combinations(range(len(rows)), size)), int).reshape(-1, size)
        for signs in product((1, -1), repeat=size):
            sums = sum(sign * rows[chosen[:, k]] for k, sign in enumerate(signs))
            flat = np.asarray(sums).reshape(len(chosen), rows.shape[1])
            is_set = ((flat == 0) | (flat == 1)).all(axis=1) & flat.any(axis=1)
            found |= {tuple(np.flatnonzero(row).tolist()) for row in flat[is_set]}
    return [list(one) for one in sorted(found)]

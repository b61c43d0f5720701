"""The behaviour of a made-up climber: which routes they try on a visit, with which result."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

_PATIENCE: Final = 6  # tries on one route in one visit
_VISIT_TRIES: Final = 22  # then the skin is gone
_LEARNT: Final = 0.35  # what a visit's tries on a route are worth, in steps of the Font scale
_REPEATS: Final = 1  # of a route that they have topped


@dataclass(frozen=True)
class Climber:
    """A climber's strength.

    Parameters
    ----------
    ability : the difficulty that they top with every other try, in steps of the Font scale.
    suits : how much easier each route is for them than for others, in the same steps.
    """

    ability: float
    suits: np.ndarray

    @classmethod
    def random(cls, rng: np.random.Generator, ability: float, routes: int) -> Climber:
        """Return a random climber whom some routes suit better than others."""
        return cls(ability, rng.normal(0.0, 1.0, routes))


@dataclass(frozen=True)
class Done:
    """One line of a log; `route` is an index of the list of routes."""

    route: int
    kind: str
    tries: int


@dataclass
class Visitor:
    """A climber, and their log so far.

    Parameters
    ----------
    hardness : of each route, in steps of the Font scale.
    """

    climber: Climber
    hardness: np.ndarray
    rng: np.random.Generator
    visits_on: dict[int, int] = field(default_factory=dict)
    tops_of: dict[int, int] = field(default_factory=dict)

    def chance(self, route: int) -> float:
        """Return the chance that the next try tops the route."""
        learnt = _LEARNT * self.visits_on.get(route, 0)
        ease = self.climber.ability + self.climber.suits[route] + learnt - self.hardness[route]
        return float(1.0 / (1.0 + np.exp(-1.1 * ease)))


def climb_visit(visitor: Visitor, current: Sequence[int]) -> Iterator[Done]:
    """Yield the ascents of one visit, in order.

    Visitors warm up on at most one route that they have topped, then try the remaining ones from
    the easiest; they skip hopeless routes.

    Parameters
    ----------
    current : indices of the routes on the wall.
    """
    rng = visitor.rng
    known = [r for r in current if 0 < visitor.tops_of.get(r, 0) <= _REPEATS]
    new = [r for r in current if r not in visitor.tops_of and visitor.chance(r) > 0.03]
    fancy = rng.normal(0.0, 1.5, len(visitor.hardness))
    new.sort(key=lambda route: float(visitor.hardness[route] + fancy[route]))
    warm = (
        [r for r in known if visitor.chance(r) > 0.8][:1]
        if len(new) < 3 or rng.random() < 0.5
        else []
    )
    plan = (*warm, *new[: int(rng.integers(3, 7))])
    if len(plan) < 2:  # not worth the way
        return
    left = int(rng.integers(_VISIT_TRIES // 2, _VISIT_TRIES))
    for route in plan:
        done = _try_route(visitor, route, min(_PATIENCE, left))
        yield done
        left -= done.tries
        if left < 1:
            return


def _try_route(visitor: Visitor, route: int, patience: int) -> Done:
    """Try one route until it is topped or the climber gives up."""
    rng, chance = visitor.rng, visitor.chance(route)
    first = route not in visitor.visits_on
    visitor.visits_on[route] = visitor.visits_on.get(route, 0) + 1
    tries = int(rng.geometric(max(chance, 0.01)))
    if tries <= patience:
        visitor.tops_of[route] = visitor.tops_of.get(route, 0) + 1
        return Done(route, "flash" if first and tries == 1 else "top", tries)
    enough = int(rng.integers(min(2, patience), patience + 1))
    kind = "zone" if rng.random() < 0.3 + chance else "project" if rng.random() < 0.3 else "try"
    return Done(route, kind, enough)

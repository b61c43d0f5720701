"""Short addresses of routes, for tags and cards: `/r/CODE`.

A code is the first 50 bits of the route's id in Crockford's base 32, which has no I, L, O and U. It
needs no table, names the route for as long as that lives, on whatever wall and version, and lets
the app find the route without reception. That any two of a million routes share one has a chance of
1 in 2,000: such a code leads nowhere rather than to the wrong one.
"""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym, Wall
from walltopo_gym.publishing.models import Route

LENGTH: Final = 10
_LETTERS: Final = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
_REST: Final = 128 - 5 * LENGTH
# Read by people from a card: what looks like a digit is one.
_ALIKE: Final = str.maketrans("ILO", "110")


def code_of(route: UUID) -> str:
    """The code of a route."""
    number = route.int >> _REST
    return "".join(_LETTERS[number >> 5 * place & 31] for place in reversed(range(LENGTH)))


def route_by_code(session: Session, code: str) -> tuple[Gym, Route]:
    """The route of a code, however it is spelt, and its gym.

    Raises
    ------
    NotFoundError : none has it, or more than one.
    """
    first = _number(code) << _REST
    last = first | ((1 << _REST) - 1)
    rows = session.execute(
        select(Gym, Route)
        .join(Wall, Wall.gym_id == Gym.id)
        .join(Route, Route.wall_id == Wall.id)
        .where(Route.id.between(UUID(int=first), UUID(int=last)))
        .limit(2)
    ).all()
    if len(rows) != 1:
        raise NotFoundError("no route has this address")
    gym, route = rows[0]
    return gym, route


def _number(code: str) -> int:
    letters = code.upper().replace("-", "").translate(_ALIKE)
    if len(letters) != LENGTH or not set(letters) <= set(_LETTERS):
        raise NotFoundError("no route has this address")
    number = 0
    for letter in letters:
        number = number << 5 | _LETTERS.index(letter)
    return number

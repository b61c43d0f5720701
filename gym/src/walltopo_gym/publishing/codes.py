"""Short addresses of routes, for tags and cards: `/r/CODE`.

A code is the first 50 bits of the route's id in Crockford's base 32, which has no I, L, O and U. It
needs no table, is valid as long as the route exists, on any wall and version, and lets the app find
the route without reception. The chance that any two of a million routes share a code is 1 in 2,000;
such a code leads nowhere rather than to the wrong route.
"""

from __future__ import annotations

from typing import Final
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.models import Wall

LENGTH: Final = 10
_LETTERS: Final = "0123456789ABCDEFGHJKMNPQRSTVWXYZ"
_REST: Final = 128 - 5 * LENGTH
# Read by people from a card: what looks like a digit is one.
_ALIKE: Final = str.maketrans("ILO", "110")


def code_of(route: UUID) -> str:
    """Return the code of a route."""
    number = route.int >> _REST
    return "".join(_LETTERS[number >> 5 * place & 31] for place in reversed(range(LENGTH)))


def route_by_code(session: Session, code: str) -> tuple[Gym, Route]:
    """Return the route of a code, in any spelling, and its gym.

    Raises
    ------
    NotFoundError : no route has it, several have it, or its gym has turned the hall off.
    """
    first = _decode_number(code) << _REST
    last = first | ((1 << _REST) - 1)
    rows = session.execute(
        select(Gym, Route)
        .join(Wall, Wall.gym_id == Gym.id)
        .join(Route, Route.wall_id == Wall.id)
        .where(Route.id.between(UUID(int=first), UUID(int=last)))
        .limit(2)
    ).all()
    if len(rows) != 1 or not rows[0][0].has("hall"):
        raise NotFoundError("short-link-unknown")
    gym, route = rows[0]
    return gym, route


def _decode_number(code: str) -> int:
    letters = code.upper().replace("-", "").translate(_ALIKE)
    if len(letters) != LENGTH or not set(letters) <= set(_LETTERS):
        raise NotFoundError("short-link-unknown")
    number = 0
    for letter in letters:
        number = number << 5 | _LETTERS.index(letter)
    return number

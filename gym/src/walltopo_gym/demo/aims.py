"""What the demo's gym wishes and has, so that its insights have something to tell."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final

from sqlalchemy.orm import Session

from walltopo_gym.gyms.models import Gym
from walltopo_gym.insights.models import Aims, Washing
from walltopo_gym.publishing.models import Route

_APART: Final = timedelta(days=14)
_WASHED: Final = timedelta(days=21)


def fill_aims(session: Session, gym: Gym, routes: Sequence[Route], at: datetime) -> None:
    """Let the routes have been set two weeks after each other, and the gym want two of each grade
    and kind of wall, have holds of each colour, and have washed its wall three weeks ago; nothing
    where it has said what it wants.

    Parameters
    ----------
    routes : that hang, all set on one day.
    """
    if session.get(Aims, gym.id) is not None or not routes:
        return
    for before, route in enumerate(routes):
        route.set_on -= (len(routes) - 1 - before) * _APART
    grades = Counter((str(route.grade_system_id), route.grade) for route in routes if route.grade)
    wish = [
        {"system": system, "grade": grade, "steepness": "", "routes": 2} for system, grade in grades
    ]
    wish += [
        {"system": None, "grade": "", "steepness": kind, "routes": 2}
        for kind in ("vertical", "slight")
    ]
    stock = [
        {"colour": colour, "type": "", "total": 40}
        for colour in sorted({route.colour for route in routes if route.colour})
    ]
    session.add(Aims(gym_id=gym.id, wish=wish, stock=stock))
    session.add(Washing(wall_id=routes[0].wall_id, washed_at=at - _WASHED))

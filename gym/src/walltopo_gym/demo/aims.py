"""The demo gym's grade targets, stock of holds, washings and hall screen."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final

from sqlalchemy.orm import Session

from walltopo_gym.gyms.models import Gym
from walltopo_gym.hall.screen import settings_of
from walltopo_gym.insights.models import Aims, Washing
from walltopo_gym.publishing.models import Route

_WASHED: Final = timedelta(days=21)


def fill_aims(session: Session, gym: Gym, routes: Sequence[Route], at: datetime) -> None:
    """Add the gym's aims once: two routes of each grade and kind of wall, holds of each colour,
    walls washed three weeks ago, and a screen that shows the board.

    Parameters
    ----------
    routes : current ones.
    """
    if session.get(Aims, gym.id) is not None or not routes:
        return
    grades = Counter((str(route.grade_system_id), route.grade) for route in routes if route.grade)
    targets = [
        {"system": system, "grade": grade, "steepness": "", "routes": 2} for system, grade in grades
    ]
    targets += [
        {"system": None, "grade": "", "steepness": kind, "routes": 6}
        for kind in ("vertical", "slight")
    ]
    stock = [
        {"colour": colour, "type": "", "total": 40}
        for colour in sorted({route.colour for route in routes if route.colour})
    ]
    session.add(Aims(gym_id=gym.id, targets=targets, stock=stock))
    for wall in sorted({route.wall_id for route in routes}):
        session.add(Washing(wall_id=wall, washed_at=at - _WASHED))
    session.merge(settings_of(session, gym.id)).board = True

"""The demo gym's grade targets, stock of holds and washings."""

from __future__ import annotations

from collections import Counter
from datetime import timedelta
from typing import Final

from sqlalchemy.orm import Session

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.insights.models import Aims, Washing

_WASHED: Final = timedelta(days=21)


def fill_aims(session: Session, event: DemoFilled) -> None:
    """Add the gym's aims once: two routes of each grade and kind of wall, holds of each colour, and
    walls washed three weeks ago."""
    gym, routes = event.gym, event.routes
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
        session.add(Washing(wall_id=wall, washed_at=event.at - _WASHED))

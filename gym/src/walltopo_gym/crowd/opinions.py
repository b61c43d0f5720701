"""Opinions of made-up climbers on the routes that they topped."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import Final

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.models import Opinion
from walltopo_gym.crowd.logs import Climber
from walltopo_gym.publishing.models import Route

_SOFT: Final = ("Soft for the grade.", "Felt a grade easier to me.", "A gift. Thank you!")
_HARD: Final = ("That last move is hard for the grade.", "Sandbagged!", "Harder than it looks.")
_GOOD: Final = (
    "Lovely moves.",
    "Best one on this wall.",
    "The start is clever.",
    "Please leave it up!",
    "Flows really well.",
)
_POOR: Final = ("The top hold spins a little.", "A bit scruffy in the middle.", "Not for me.")
# Share of the tops that somebody rates, and of the ratings with words.
_RATED, _COMMENTED = 0.45, 0.09


def give_opinions(
    session: Session,
    person: Person,
    climber: Climber,
    routes: Sequence[Route],
    topped: Mapping[int, datetime],
    rng: np.random.Generator,
) -> None:
    """Add stars and grade votes of a climber on some of their topped routes.

    A route that suits a climber feels easier to them than its grade, and better.

    Parameters
    ----------
    topped : index of a route to the time of the first top.
    """
    for which, at in topped.items():
        if rng.random() > _RATED:
            continue
        route, suits = routes[which], float(climber.suits[which])
        own = FONT.index(route.grade)
        felt = int(np.clip(own - round(0.5 * suits + rng.normal(0, 0.3)), 0, len(FONT) - 1))
        stars = int(np.clip(round(_route_quality(which) + 0.4 * suits + rng.normal(0, 0.6)), 1, 5))
        wish = "keep" if stars == 5 else "renew" if stars < 3 else ""
        session.add(
            Opinion(
                person_id=person.id,
                route_id=route.id,
                grade=FONT[felt],
                stars=stars,
                wish=wish,
                comment=_made_comment(session, route, felt - own, stars, rng),
                changed_at=at + timedelta(minutes=1),
            )
        )
    session.flush()


def _route_quality(which: int) -> float:
    """Return the stars that a route deserves: two routes in five are well loved."""
    return (4.4, 3.4, 3.8, 2.6, 4.1)[which % 5]


def _made_comment(
    session: Session, route: Route, harder: int, stars: int, rng: np.random.Generator
) -> str:
    """Return a comment that fits the vote and is new on the route; mostly an empty one."""
    if rng.random() > _COMMENTED:
        return ""
    words = _HARD if harder > 0 else _SOFT if harder < 0 else _GOOD if stars > 3 else _POOR
    used = set(session.scalars(select(Opinion.comment).where(Opinion.route_id == route.id)))
    new = [text for text in words if text not in used]
    return str(rng.choice(new)) if new else ""

"""Made-up climbers and their ascents of ten weeks; the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import UTC, date, datetime, time, timedelta
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.people import NO_PASSWORD, Audience, Category
from walltopo_gym.climbing.ascents import new_ascent
from walltopo_gym.climbing.kinds import TOPS
from walltopo_gym.climbing.models import Ascent, Follow
from walltopo_gym.crowd.logs import Climber, Visitor, climb_visit
from walltopo_gym.crowd.opinions import give_opinions
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route

DAYS: Final = 70
_SEED: Final = 20260301
_NAMES: Final = (
    "Ada L.",
    "Ben K.",
    "Chiara M.",
    "Dana S.",
    "Emil P.",
    "Fay O.",
    "Goran V.",
    "Hana N.",
    "Ines R.",
    "Jan H.",
    "Kim T.",
    "Lars B.",
    "Mina A.",
    "Noel D.",
    "Olga F.",
    "Petr Z.",
    "Quentin G.",
    "Rosa C.",
    "Sami J.",
    "Tereza K.",
    "Uli W.",
    "Vera I.",
    "Wanda B.",
    "Xaver E.",
    "Yuki M.",
    "Zoe L.",
    "Amir H.",
    "Bea F.",
    "Cyril D.",
    "Doris N.",
    "Eva S.",
    "Filip R.",
    "Greta P.",
    "Hugo V.",
    "Iris T.",
    "Jonas M.",
    "Klara C.",
    "Leo A.",
    "Maja O.",
    "Nico G.",
)
CLIMBERS: Final = len(_NAMES)
_OWN_ABILITY: Final = 0.8


def abilities(routes: Sequence[Route]) -> np.ndarray:
    """Return the grade that each climber tops every other time, in steps of the Font scale."""
    rng = np.random.default_rng(_SEED)
    middle = float(np.mean([FONT.index(route.grade) for route in routes]))
    return np.asarray(rng.normal(middle - 0.5, 2.5, CLIMBERS))


def add_climbers(session: Session, gym: Gym, routes: Sequence[Route], until: datetime) -> None:
    """Add the climbers and their logs of the ten weeks before `until`, once.

    Parameters
    ----------
    routes : current ones, graded by Font.
    """
    here = select(func.count()).select_from(Ascent).where(Ascent.gym_id == gym.id)
    if session.scalar(here):
        return
    rng = np.random.default_rng(_SEED + 1)
    since = until - timedelta(days=DAYS + 1)
    people = [_add_climber(session, gym, number, since) for number in range(CLIMBERS)]
    session.flush()
    session.add_all(_make_profile(person, number) for number, person in enumerate(people))
    # Some come three times a fortnight, most now and then.
    weekly = rng.gamma(1.6, 0.45, CLIMBERS).clip(0.15, 2.0)
    for person, ability, often in zip(people, abilities(routes), weekly, strict=True):
        days = np.flatnonzero(rng.random(DAYS) < often / 7).tolist()
        climber = Climber.random(rng, float(ability), len(routes))
        _add_log(session, gym, person, climber, routes, _dates_of_days(days, until), rng)


def fill_own(
    session: Session, gym: Gym, climber: UUID, routes: Sequence[Route], until: datetime
) -> None:
    """Add the log of the demo's own climber, who comes twice a week and follows others, once."""
    mine = select(func.count()).select_from(Ascent).where(Ascent.person_id == climber)
    if session.scalar(mine):
        return
    rng = np.random.default_rng(_SEED + 2)
    person = session.get_one(Person, climber)
    person.created_at = until - timedelta(days=DAYS + 1)
    ability = float(np.mean([FONT.index(route.grade) for route in routes])) + _OWN_ABILITY
    days = [day for day in range(DAYS) if day % 7 in (1, 4)]
    drawn = Climber.random(rng, ability, len(routes))
    _add_log(session, gym, person, drawn, routes, _dates_of_days(days, until), rng)
    session.merge(Profile(person_id=climber, on_boards=True, show_ascents=Audience.GYM, feed=True))
    for number in range(CLIMBERS):
        other = select(Person.id).where(Person.email == email_of(gym, number))
        if number % 5 == 0:
            followed = session.scalars(other).one()
            session.add(Follow(follower_id=climber, followed_id=followed, accepted=True))
        elif number % 13 == 1:
            follower = session.scalars(other).one()
            session.add(Follow(follower_id=follower, followed_id=climber, accepted=False))
    session.flush()


def email_of(gym: Gym, number: int) -> str:
    """Return the address that a made-up climber cannot sign in with."""
    return f"climber{number}@{gym.slug}.invalid"


def _dates_of_days(days: Sequence[int], until: datetime) -> list[date]:
    """Return the dates of days that are counted from `DAYS` days before `until`."""
    return [(until - timedelta(days=DAYS - day)).date() for day in days]


def _add_log(
    session: Session,
    gym: Gym,
    person: Person,
    climber: Climber,
    routes: Sequence[Route],
    dates: Sequence[date],
    rng: np.random.Generator,
) -> None:
    """Add a person's ascents on these dates, and their opinions of what they topped."""
    hardness = np.array([FONT.index(route.grade) for route in routes], float)
    visitor = Visitor(climber, hardness, rng)
    topped: dict[int, datetime] = {}
    for day in dates:
        current = [n for n, route in enumerate(routes) if route.set_on <= day]
        at = datetime.combine(day, time(16, 30), UTC) + timedelta(minutes=int(rng.integers(150)))
        for done in climb_visit(visitor, current):
            at += timedelta(minutes=int(4 + 3 * done.tries + rng.integers(6)))
            route = routes[done.route]
            session.add(
                new_ascent(
                    person.id,
                    gym,
                    route,
                    created_at=at,
                    kind=done.kind,
                    tries=done.tries,
                    climbed_at=at,
                )
            )
            if done.kind in TOPS:
                topped.setdefault(done.route, at)
    give_opinions(session, person, climber, routes, topped, rng)


def _add_climber(session: Session, gym: Gym, number: int, since: datetime) -> Person:
    person = Person(
        email=email_of(gym, number),
        name=_NAMES[number],
        password_hash=NO_PASSWORD,
        created_at=since,
    )
    session.add(person)
    session.flush()
    membership = Membership(gym_id=gym.id, person_id=person.id, role=Role.MEMBER, created_at=since)
    session.add(membership)
    return person


def _make_profile(person: Person, number: int) -> Profile:
    """Return a profile. Three of four want to be ranked and let the gym see their ascents."""
    is_open = number % 4 != 3
    shown = Audience.GYM if is_open else Audience.NOBODY
    categories = (Category.WOMEN, Category.MEN, Category.UNSAID, Category.OTHER)
    return Profile(
        person_id=person.id,
        on_boards=is_open,
        on_screens=is_open,
        show_ascents=shown,
        show_pins=shown,
        category=categories[number % 3 if number % 10 else 3],
        birth_year=1965 + number,
    )

"""Made-up climbers, and what they climbed in six weeks; the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.people import NO_PASSWORD
from walltopo_gym.accounts.profiles import Audience, Category
from walltopo_gym.climbing.models import Ascent, Follow, Opinion
from walltopo_gym.gyms.grades import FONT
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.publishing.models import Route

CLIMBERS: Final = 40
ASCENTS: Final = 600
_DAYS: Final = 42
_SEED: Final = 20260301
_FIRST: Final = ("Ada", "Ben", "Chi", "Dana", "Emil", "Fay", "Goran", "Hana", "Ines", "Jan")
_LAST: Final = ("Arete", "Bouldrova", "Crimp", "Dyno")
_WISHES: Final = ("", "", "keep", "renew")
_TIRED_WISHES: Final = ("", "renew", "renew", "renew")
_SAID: Final = ("Great moves", "The top is harder than it looks", "Feels soft", "Please keep it")


def fill(session: Session, gym: Gym, routes: Sequence[Route], until: datetime) -> None:
    """Let them have climbed in the six weeks before `until`; nothing where they have already.

    Parameters
    ----------
    routes : that hang, graded by Font.
    """
    here = select(func.count()).select_from(Ascent).where(Ascent.gym_id == gym.id)
    if session.scalar(here):
        return
    rng = np.random.default_rng(_SEED)
    people = [_person(session, gym, number) for number in range(CLIMBERS)]
    session.flush()
    session.add_all(_profile(person, number) for number, person in enumerate(people))
    hardness = np.array([FONT.index(route.grade) for route in routes], float)
    skill = rng.normal(hardness.mean() + 1.0, 2.5, CLIMBERS)
    keen = rng.dirichlet(np.full(CLIMBERS, 1.5))  # some come often, some once
    seen: set[tuple[int, int]] = set()
    moments = np.sort(rng.integers(0, _DAYS, ASCENTS))
    for day in moments:
        who, which = int(rng.choice(CLIMBERS, p=keen)), int(rng.integers(len(routes)))
        ease = skill[who] - hardness[which]
        kind, tries = _outcome(rng, ease, (who, which) in seen)
        seen.add((who, which))
        session.add(
            _ascent(
                rng, people[who], gym, routes[which], kind, tries, _evening(rng, until, int(day))
            )
        )
    for who, which in sorted(seen):
        if rng.random() < 0.5:
            session.add(_opinion(rng, people[who], routes[which], until, tired=which == 0))


def fill_own(
    session: Session, gym: Gym, climber: UUID, routes: Sequence[Route], until: datetime
) -> None:
    """Let the demo's own climber have come twice a week, and follow some of the others; nothing
    where they have climbed already."""
    mine = select(func.count()).select_from(Ascent).where(Ascent.person_id == climber)
    if session.scalar(mine):
        return
    rng = np.random.default_rng(_SEED + 1)
    person = session.get_one(Person, climber)
    skill = float(np.mean([FONT.index(route.grade) for route in routes])) + 1.5
    seen: set[int] = set()
    for day in (d for d in range(_DAYS) if d % 7 in (1, 4)):
        for which in rng.integers(len(routes), size=int(rng.integers(4, 8))).tolist():
            ease = skill + day / _DAYS - FONT.index(routes[which].grade)
            kind, tries = _outcome(rng, ease, which in seen)
            seen.add(which)
            at = _evening(rng, until, day)
            session.add(_ascent(rng, person, gym, routes[which], kind, tries, at))
    session.merge(Profile(person_id=climber, on_boards=True, show_ascents=Audience.GYM, feed=True))
    others = select(Person).where(Person.email.like(f"climber%@{gym.slug}.invalid"))
    for number, other in enumerate(session.scalars(others.order_by(Person.email))):
        if number % 5 == 0:
            session.add(Follow(follower_id=climber, followed_id=other.id, accepted=True))
        elif number % 13 == 1:
            session.add(Follow(follower_id=other.id, followed_id=climber, accepted=False))
    session.flush()


def _person(session: Session, gym: Gym, number: int) -> Person:
    name = f"{_FIRST[number % len(_FIRST)]} {_LAST[number // len(_FIRST)]} (made up)"
    person = Person(
        email=f"climber{number}@{gym.slug}.invalid", name=name, password_hash=NO_PASSWORD
    )
    session.add(person)
    session.flush()
    session.add(Membership(gym_id=gym.id, person_id=person.id, role=Role.MEMBER))
    return person


def _profile(person: Person, number: int) -> Profile:
    """Three of four want to be ranked, and then let the gym see what they climb."""
    is_open = number % 4 != 3
    shown = Audience.GYM if is_open else Audience.NOBODY
    said = (Category.WOMEN, Category.MEN, Category.UNSAID, Category.OTHER)
    return Profile(
        person_id=person.id, on_boards=is_open, show_ascents=shown, show_pins=shown,
        category=said[number % 3 if number % 10 else 3], birth_year=1965 + number,
    )  # fmt: skip


def _outcome(rng: np.random.Generator, ease: float, again: bool) -> tuple[str, int]:
    """Kind and tries: the easier for this person, the sooner; a flash only the first time."""
    chance = 1.0 / (1.0 + np.exp(-ease))
    tries = int(rng.geometric(np.clip(chance, 0.1, 0.95)))
    if tries > 8:
        return ("project" if rng.random() < 0.3 else "try"), 8
    if tries == 1 and not again:
        return "flash", 1
    return "top", tries


def _evening(rng: np.random.Generator, until: datetime, day: int) -> datetime:
    """Some time between five and nine in the evening (UTC), never after `until`."""
    date = (until - timedelta(days=_DAYS - day)).replace(hour=17, minute=0, second=0, microsecond=0)
    return min(date + timedelta(minutes=int(rng.integers(0, 240))), until)


def _ascent(
    rng: np.random.Generator, person: Person, gym: Gym, route: Route, kind: str, tries: int,
    at: datetime,
) -> Ascent:  # fmt: skip
    return Ascent(
        id=UUID(bytes=rng.bytes(16), version=4), created_at=at, person_id=person.id, gym_id=gym.id,
        route_id=route.id, gym_name=gym.name, route_name=route.name, grade=route.grade, kind=kind,
        tries=tries, climbed_at=at,
    )  # fmt: skip


def _opinion(
    rng: np.random.Generator, person: Person, route: Route, until: datetime, *, tired: bool
) -> Opinion:
    """What somebody says of a route; of one they are `tired` of most want another."""
    grade = FONT[int(np.clip(FONT.index(route.grade) + rng.integers(-1, 2), 0, len(FONT) - 1))]
    return Opinion(
        person_id=person.id, route_id=route.id, grade=grade, stars=int(rng.integers(2, 6)),
        wish=str(rng.choice(_TIRED_WISHES if tired else _WISHES)),
        comment=str(rng.choice(_SAID)) if rng.random() < 0.15 else "", changed_at=until,
    )  # fmt: skip

"""Two made-up festivals of the demo gym: one is over, one runs; the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.competitions.entering import EntryWords, add_entry
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.making import (
    CategoryWish,
    ProblemWish,
    RoundWish,
    change_sheet,
)
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
)
from walltopo_gym.competitions.running import move_competition
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route

COMPETITORS: Final = 24
_SEED: Final = 20260314
_EVENING: Final = timedelta(hours=3)
_MADE_UP: Final = " (made up)"
_WAIVER: Final = "I climb at my own risk. (A made-up text of a made-up competition.)"
_TEAMS: Final = ("", "Chalk Club", "Slab Society")


def hold_cups(
    session: Session, gym: Gym, judge: UUID, routes: Sequence[Route], at: datetime
) -> None:
    """One festival of three weeks ago, and one that began an hour ago. Where they are there already
    the one that runs goes on for another evening.

    Parameters
    ----------
    judge : by whose account results were entered; routes : that are its problems; at : now.
    """
    if session.scalar(select(Competition.id).where(Competition.gym_id == gym.id)) is not None:
        _go_on(session, gym, at)
        return
    rng = np.random.default_rng(_SEED)
    mailed = Person.email.like(f"climber%@{gym.slug}.invalid")
    people = session.scalars(select(Person).where(mailed).order_by(Person.email)).all()
    for name, begins, ends, share in (
        ("Autumn Jam", at - timedelta(days=21), at - timedelta(days=21, hours=-4), 1.0),
        ("Friday Jam", at - timedelta(hours=1), at + _EVENING, 0.4),
    ):
        row = _made(session, gym, name + _MADE_UP, routes, begins, ends)
        _enter(session, row, people[:COMPETITORS])
        move_competition(session, row, "running")
        one = session.scalars(select(Round).where(Round.competition_id == row.id)).one()
        one.begun_at = begins
        _climb(session, rng, row, one, judge, begins, min(at, ends), share)
        if ends < at:
            move_competition(session, row, "ended")


def _go_on(session: Session, gym: Gym, at: datetime) -> None:
    """A demo that is looked at another day has a competition that runs, too."""
    over = select(Competition).where(
        Competition.gym_id == gym.id, Competition.name.endswith(_MADE_UP),
        Competition.state == "running", Competition.ends_at < at,
    )  # fmt: skip
    for row in session.scalars(over):
        row.ends_at = at + _EVENING
        row.revision += 1
        for one in session.scalars(select(Round).where(Round.competition_id == row.id)):
            one.closes_at = row.ends_at


def _made(
    session: Session, gym: Gym, name: str, routes: Sequence[Route], begins: datetime, ends: datetime
) -> Competition:
    row = Competition(
        gym_id=gym.id, name=name, format="festival", about="Climb what you like, all evening.",
        fee="12 EUR at the desk", waiver=_WAIVER, starts_at=begins, ends_at=ends,
        self_entry=True, self_scoring=True, revision=0, last_seq=0, state="draft",
    )  # fmt: skip
    session.add(row)
    session.flush()
    rounds = RoundWish(
        None, "Session", "open", {"rules": "points", "best": 8}, None, begins, ends,
        [ProblemWish(None, route_id=route.id) for route in routes],
    )  # fmt: skip
    categories = [CategoryWish(None, "Women", "women"), CategoryWish(None, "Men", "men")]
    change_sheet(session, row, categories, [rounds])
    return row


def _enter(session: Session, row: Competition, people: Sequence[Person]) -> None:
    of = select(Category).where(Category.competition_id == row.id).order_by(Category.place)
    categories = session.scalars(of).all()
    for number, person in enumerate(people):
        category = categories[number % len(categories)]
        words = EntryWords(person.name, category.id, team=_TEAMS[number % len(_TEAMS)],
                           gender=category.gender)  # fmt: skip
        add_entry(session, row, words, person.id)


def _climb(
    session: Session, rng: np.random.Generator, row: Competition, one: Round, judge: UUID,
    begins: datetime, until: datetime, share: float,
) -> None:  # fmt: skip
    """Events spread over the time: the further a problem stands in the list, the harder it is."""
    entries = session.scalars(
        select(Entry).where(Entry.competition_id == row.id).order_by(Entry.bib)
    ).all()
    problems = session.scalars(
        select(Problem).where(Problem.round_id == one.id).order_by(Problem.place)
    ).all()
    skill = rng.uniform(0.2, 1.0, len(entries))
    said: list[tuple[float, UUID, UUID, Kind, int]] = []
    for who, entry in enumerate(entries):
        for place, problem in enumerate(problems):
            if rng.random() > share:
                continue
            ease = skill[who] - 0.7 * place / max(1, len(problems))
            tries = int(rng.integers(1, 6))
            kind = Kind.TOP if rng.random() < ease else Kind.ZONE
            if kind == Kind.ZONE and rng.random() > ease + 0.4:
                kind = Kind.ATTEMPT
            said.append((float(rng.random()), entry.id, problem.id, kind, tries))
    for number, (moment, entry_id, problem_id, kind, tries) in enumerate(sorted(said), 1):
        at = begins + moment * (until - begins)
        session.add(
            ScoreEvent(
                id=UUID(bytes=rng.bytes(16), version=4), competition_id=row.id, seq=number,
                entry_id=entry_id, problem_id=problem_id, kind=kind, n=tries, person_id=judge,
                device="demo", number=number, made_at=at, climbed_at=at, at=at,
            )
        )  # fmt: skip
    row.last_seq = len(said)
    session.flush()

"""Two made-up festivals of the demo gym: one is over, one runs; the same from the same seed."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID, uuid4

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_climb.grades.font import FONT
from walltopo_gym.accounts.models import Person
from walltopo_gym.competitions.bodies import CategoryBody, EntryBody, RoundBody, ScoringBody
from walltopo_gym.competitions.entering import add_entry
from walltopo_gym.competitions.ledger import Kind
from walltopo_gym.competitions.models import (
    Category,
    Competition,
    Entry,
    Problem,
    Round,
    ScoreEvent,
)
from walltopo_gym.competitions.scoring.rules import Rules
from walltopo_gym.competitions.service import (
    change_sheet,
    move_competition,
)
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.crowd.logs import Climber, Visitor
from walltopo_gym.crowd.people import abilities, email_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route

COMPETITORS: Final = 24
_SEED: Final = 20260314
_EVENING: Final = timedelta(hours=3)
_NAMES: Final = ("Autumn Jam", "Evening Jam")
_WAIVER: Final = "I climb at my own risk."
_TRIES: Final = 5
_TEAMS: Final = ("", "Chalk Club", "Slab Society")


def hold_cups(session: Session, event: DemoFilled) -> None:
    """Add a festival of three weeks ago, and one that began an hour ago, in which the routes are
    the problems. If they exist, the running one continues for another evening."""
    gym, judge, routes, at = event.gym, event.setter, event.routes, event.at
    if session.scalar(select(Competition.id).where(Competition.gym_id == gym.id)) is not None:
        _go_on(session, gym, at)
        return
    rng = np.random.default_rng(_SEED)
    emails = [email_of(gym, number) for number in range(COMPETITORS)]
    of = {
        person.email: person
        for person in session.scalars(select(Person).where(Person.email.in_(emails)))
    }
    people = [of[email] for email in emails]
    past = (at - timedelta(days=21)).replace(hour=17, minute=0, second=0, microsecond=0)
    for name, begins, ends, share in (
        (_NAMES[0], past, past + timedelta(hours=4), 0.9),
        (_NAMES[1], at - timedelta(hours=1), at + _EVENING, 0.5),
    ):
        row = _make_competition(session, gym, name, routes, begins, ends)
        _enter_people(session, row, people)
        move_competition(session, row, "running")
        one = session.scalars(select(Round).where(Round.competition_id == row.id)).one()
        one.begun_at = begins
        _add_results(session, rng, row, one, judge, routes, begins, min(at, ends), share)
        if ends < at:
            move_competition(session, row, "ended")


def _go_on(session: Session, gym: Gym, at: datetime) -> None:
    """Extend the running competition, so that a demo opened on another day has one."""
    over = select(Competition).where(
        Competition.gym_id == gym.id,
        Competition.name.in_(_NAMES),
        Competition.state == "running",
        Competition.ends_at < at,
    )
    for row in session.scalars(over):
        row.ends_at = at + _EVENING
        row.revision += 1
        for one in session.scalars(select(Round).where(Round.competition_id == row.id)):
            one.closes_at = row.ends_at


def _make_competition(
    session: Session, gym: Gym, name: str, routes: Sequence[Route], begins: datetime, ends: datetime
) -> Competition:
    row = Competition(
        gym_id=gym.id,
        name=name,
        format="festival",
        about="Climb what you like, all evening.",
        fee="12 EUR at the desk",
        waiver=_WAIVER,
        starts_at=begins,
        ends_at=ends,
        self_entry=True,
        self_scoring=True,
        revision=0,
        last_seq=0,
        state="draft",
    )
    session.add(row)
    session.flush()
    rounds = RoundBody(
        name="Session",
        scoring=ScoringBody(rules=Rules("points"), best=8),
        opens_at=begins,
        closes_at=ends,
        route_ids=[route.id for route in routes],
        problems=[],
    )
    categories = [
        CategoryBody(name="Women", gender="women"),
        CategoryBody(name="Men", gender="men"),
    ]
    change_sheet(session, row, categories, [rounds])
    return row


def _enter_people(session: Session, row: Competition, people: Sequence[Person]) -> None:
    of = select(Category).where(Category.competition_id == row.id).order_by(Category.place)
    categories = session.scalars(of).all()
    for number, person in enumerate(people):
        category = categories[number % len(categories)]
        words = EntryBody.model_validate(
            {
                "name": person.name,
                "category_id": category.id,
                "gender": category.gender,
                "team": _TEAMS[number % len(_TEAMS)],
            }
        )
        add_entry(session, row, words, person.id)


def _add_results(
    session: Session,
    rng: np.random.Generator,
    row: Competition,
    one: Round,
    judge: UUID,
    routes: Sequence[Route],
    begins: datetime,
    until: datetime,
    share: float,
) -> None:
    """Add results spread over the time, by the ability that each climber's log shows."""
    entries = session.scalars(
        select(Entry).where(Entry.competition_id == row.id).order_by(Entry.bib)
    ).all()
    problems = session.scalars(
        select(Problem).where(Problem.round_id == one.id).order_by(Problem.place)
    ).all()
    hardness = np.array([FONT.index(route.grade) for route in routes], float)
    attempts: list[tuple[float, UUID, UUID, Kind, int]] = []
    for entry, ability in zip(entries, abilities(routes).tolist(), strict=False):
        visitor = Visitor(Climber.random(rng, ability, len(routes)), hardness, rng)
        for which, problem in enumerate(problems):
            chance = visitor.chance(which)
            if rng.random() > share or chance < 0.03:
                continue
            tries = int(rng.geometric(chance))
            kind = Kind.TOP if tries <= _TRIES else Kind.ZONE
            if kind == Kind.ZONE and rng.random() > 0.4 + chance:
                kind = Kind.ATTEMPT
            attempts.append((float(rng.random()), entry.id, problem.id, kind, min(tries, _TRIES)))
    for number, (moment, entry_id, problem_id, kind, tries) in enumerate(sorted(attempts), 1):
        at = begins + moment * (until - begins)
        session.add(
            ScoreEvent(
                id=uuid4(),
                competition_id=row.id,
                seq=number,
                entry_id=entry_id,
                problem_id=problem_id,
                kind=kind,
                n=tries,
                person_id=judge,
                device="demo",
                number=number,
                made_at=at,
                climbed_at=at,
                at=at,
            )
        )

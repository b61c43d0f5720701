"""Lists of the demo gym: a circuit of its setter, and a group's homework."""

from __future__ import annotations

from typing import Final

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person
from walltopo_gym.climbing.sharing import Share
from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.crowd.people import email_of
from walltopo_gym.lists.models import ClimbList, ListMember

_COACH: Final = 0
_GROUP: Final = range(1, 5)
_CIRCUIT, _HOMEWORK = 8, 5  # routes


def make_lists(session: Session, event: DemoFilled) -> None:
    """Add the lists, once."""
    gym = event.gym
    if session.scalar(select(func.count()).where(ClimbList.gym_id == gym.id)):
        return
    routes = [str(route.id) for route in event.routes]
    circuit = ClimbList(
        gym_id=gym.id,
        person_id=event.setter,
        name="Saturday circuit",
        share=Share.GYM.value,
        circuit=True,
        items=routes[:_CIRCUIT],
    )
    coach, *group = (
        session.scalars(select(Person).where(Person.email == email_of(gym, number))).one()
        for number in (_COACH, *_GROUP)
    )
    homework = ClimbList(
        gym_id=gym.id,
        person_id=coach.id,
        name="Thursday group",
        note="Once without cutting loose.",
        share=Share.GYM.value,
        items=routes[-_HOMEWORK:],
    )
    session.add_all([circuit, homework])
    session.flush()
    session.add_all(
        ListMember(list_id=homework.id, person_id=person.id, shows_progress=True)
        for person in group
    )

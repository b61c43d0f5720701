"""Lists of routes and problems, as a feature of the platform."""

from __future__ import annotations

from sqlalchemy.orm import Session

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.events import OwnTables
from walltopo_gym.feature import Feature
from walltopo_gym.lists.demo import make_lists
from walltopo_gym.lists.models import ClimbList, ListMember


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend([("lists", ClimbList), ("list_members", ListMember)])


FEATURE = Feature(
    "lists",
    listeners={DemoFilled: (make_lists,)},
    data_listeners={OwnTables: (_own_tables,)},
)

"""The log of all climbs, as a feature of the platform."""

from __future__ import annotations

from sqlalchemy.orm import Session

from walltopo_gym.climbing_log.models import OtherAscent
from walltopo_gym.climbing_log.other import logged_others
from walltopo_gym.events import LoggedClimbs, OwnTables
from walltopo_gym.feature import Feature


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.append(("other_ascents", OtherAscent))


FEATURE = Feature(
    "climbing_log",
    data_listeners={LoggedClimbs: (logged_others,), OwnTables: (_own_tables,)},
)

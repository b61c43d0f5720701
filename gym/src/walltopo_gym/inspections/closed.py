"""The walls that an inspection closed to climbers."""

from __future__ import annotations

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from walltopo_gym.events import ClosedWalls
from walltopo_gym.gyms.models import Gym
from walltopo_gym.inspections.models import InspectedWall, Inspection
from walltopo_gym.inspections.record import Result


def add_closed(session: Session, question: ClosedWalls) -> None:
    """Answer with the walls whose latest finished inspection closed them, and when it ended.

    Nobody sees or ends a closure while the gym has inspections switched off, so none counts then.
    """
    if not session.get_one(Gym, question.gym).has("inspections"):
        return
    latest = (
        select(
            InspectedWall.wall_id,
            Inspection.result,
            Inspection.finished_at,
            func.row_number()
            .over(partition_by=InspectedWall.wall_id, order_by=Inspection.finished_at.desc())
            .label("number"),
        )
        .join(Inspection, Inspection.id == InspectedWall.inspection_id)
        .where(Inspection.gym_id == question.gym, Inspection.finished_at.is_not(None))
        .subquery()
    )
    closed = select(latest.c.wall_id, latest.c.finished_at).where(
        latest.c.number == 1, latest.c.result == Result.CLOSED
    )
    question.found.extend((wall, at) for wall, at in session.execute(closed))

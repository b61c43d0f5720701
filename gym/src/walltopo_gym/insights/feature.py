"""Insights for setters, as a feature of the platform."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.events import HoldHistoryOf, HoldMoment
from walltopo_gym.feature import Feature
from walltopo_gym.insights.demo import fill_aims
from walltopo_gym.insights.models import Washing


def _add_washings(session: Session, question: HoldHistoryOf) -> None:
    """Answer with the washings of the wall since the hold is on it."""
    rows = select(Washing.washed_at).where(
        Washing.wall_id == question.wall, Washing.washed_at >= question.since
    )
    latest = session.scalars(rows.order_by(Washing.washed_at.desc()).limit(question.most))
    question.found.extend(HoldMoment(at, "wall-washed") for at in latest)


FEATURE = Feature(
    "insights",
    listeners={DemoFilled: (fill_aims,), HoldHistoryOf: (_add_washings,)},
    switch="insights",
)

"""The demo gym's screen, which shows the board."""

from __future__ import annotations

from sqlalchemy.orm import Session

from walltopo_gym.crowd.filled import DemoFilled
from walltopo_gym.hall.models import HallSettings
from walltopo_gym.hall.screen import settings_of


def show_board(session: Session, event: DemoFilled) -> None:
    """Show the board on the gym's screen, unless somebody chose otherwise."""
    if session.get(HallSettings, event.gym.id) is None:
        session.merge(settings_of(session, event.gym.id)).board = True

"""The screen in the hall: its settings, and the link that opens a private gym's screen."""

from __future__ import annotations

from typing import Final, Literal
from uuid import UUID

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.accounts.secrets import hash_of, new_secret
from walltopo_gym.climbing.boards import BoardLine, month_of
from walltopo_gym.climbing.models import Standing
from walltopo_gym.clock import now
from walltopo_gym.events import Admission
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.hall.models import HallSettings

Part = Literal["routes", "wall", "climbers", "board", "dates"]
PARTS: Final[tuple[Part, ...]] = ("routes", "wall", "climbers", "board", "dates")
# Cookie of a screen in the hall: the screen is a guest of one private gym.
KIOSK: Final = "__Host-walltopo-kiosk"
_SECONDS: Final = 20
_DAYS: Final = 14


def settings_of(session: Session, gym: UUID) -> HallSettings:
    """Return a gym's screen settings; the defaults outside of the session if there are none."""
    kept = session.get(HallSettings, gym)
    if kept is not None:
        return kept
    return HallSettings(gym_id=gym, parts=list(PARTS), seconds=_SECONDS, days=_DAYS, board=False)


def new_key(session: Session, gym: UUID) -> str:
    """Return a new secret that opens this gym's screen; the earlier one is void."""
    row = session.merge(settings_of(session, gym))
    secret, row.key_hash = new_secret()
    row.key_made_at = now()
    return secret


def drop_key(session: Session, gym: UUID) -> None:
    """Void the secret; repeating it is fine."""
    row = session.get(HallSettings, gym)
    if row is not None:
        row.key_hash = row.key_made_at = None


def has_key(session: Session, gym: UUID, secret: str) -> bool:
    """Return whether a secret opens this gym's screen; false if the gym has turned the hall off."""
    row = session.get(HallSettings, gym)
    if row is None or row.key_hash != hash_of(secret):
        return False
    return session.get_one(Gym, gym).has("hall")


def admit_screen(session: Session, question: Admission) -> None:
    """Admit the screen of a private gym."""
    secret = question.cookies.get(KIOSK, "")
    if secret and has_key(session, question.gym, secret):
        question.found.append(True)


def public_board(session: Session, gym: Gym, size: int) -> list[BoardLine] | None:
    """Return the top of this month's board, of people who agreed to be public; None if the gym
    shows none."""
    if gym.boards == "off" or not settings_of(session, gym.id).board:
        return None
    rows = session.execute(
        select(Standing.person_id, Person.name, Standing.points, Standing.tops, Standing.flashes)
        .join(Person, Person.id == Standing.person_id)
        .join(Profile, Profile.person_id == Standing.person_id)
        .join(
            Membership,
            (Membership.person_id == Standing.person_id) & (Membership.gym_id == gym.id),
        )
        .where(Standing.gym_id == gym.id, Standing.period == month_of(gym, now()))
        .where(Standing.circuit == "", Profile.on_boards.is_(True), Profile.on_screens.is_(True))
        .order_by(Standing.points.desc(), Person.name, Standing.person_id)
        .limit(size)
    )
    lines: list[BoardLine] = []
    for rank, row in enumerate(rows, 1):
        same = lines and lines[-1].points == row.points
        lines.append(BoardLine(lines[-1].rank if same else rank, *row))
    return lines

"""Films of clips: what others may see of a clip if its climber publishes it.

A climber wants a film when sending the clip; else nothing of the video is kept. The job makes it
with other people hidden. The climber looks at it, and publishes it with the confirmed moves, or it
goes after `KEPT_DAYS`. The climber and the gym's setters can remove it at any time.
"""

from __future__ import annotations

from collections.abc import Collection
from datetime import timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import ColumnElement, Select, delete, exists, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import Person, Profile
from walltopo_gym.clips.models import Clip, FilmReport
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError
from walltopo_gym.gyms.models import Ban, Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.settings import Switch
from walltopo_gym.walls.models import Wall

MIN_AGE: Final = 16  # years
KEPT_DAYS: Final = 7


def check_films(session: Session, gym: Gym, person: UUID, switches: Collection[Switch]) -> None:
    """Refuse films where the gym has none, and those of children.

    Raises
    ------
    ForbiddenError : either of both.
    """
    if "films" not in gym.features(switches):
        raise ForbiddenError("film-none-here")
    if _is_child(session, person):
        raise ForbiddenError("film-too-young", "film-age", age=MIN_AGE)


def may_publish(session: Session, gym: Gym, person: UUID, switches: Collection[Switch]) -> bool:
    """Return whether somebody may publish films in a gym."""
    return "films" in gym.features(switches) and not _is_child(session, person)


def _is_child(session: Session, person: UUID) -> bool:
    """Return whether somebody may be younger than `MIN_AGE` by their year of birth, if it is
    known."""
    profile = session.get(Profile, person)
    born = None if profile is None else profile.birth_year
    return born is not None and now().year - born <= MIN_AGE  # the day is not known


def publish_film(session: Session, clip: Clip) -> None:
    """Show a clip's film at its route.

    Raises
    ------
    ConflictError : it has no film, or its moves are not confirmed.
    """
    if clip.film_size is None:
        raise ConflictError("film-not-there")
    if clip.confirmed_at is None:
        raise ConflictError("film-confirm-first")
    clip.published_at = clip.published_at or now()


def remove_film(session: Session, clip: Clip) -> None:
    """Forget a clip's film and its reports; the hourly chore deletes the file."""
    clip.film_size = clip.published_at = None
    session.execute(delete(FilmReport).where(FilmReport.clip_id == clip.id))


def published_films(gym: UUID, route: UUID) -> Select[Clip, str]:
    """Return the query of a route's films with their climbers' names."""
    return (
        select(Clip, Person.name)
        .join(Person, Person.id == Clip.person_id)
        .where(Clip.route_id == route, Clip.published_at.is_not(None), ~_is_banned(gym))
    )


def film_of(session: Session, gym: UUID, clip: UUID, person: UUID | None) -> Clip:
    """Return a clip of a gym whose film somebody may see: a published one, or one's own.

    Raises
    ------
    NotFoundError : there is none.
    """
    wanted = (
        select(Clip)
        .join(Route, Route.id == Clip.route_id)
        .join(Wall, Wall.id == Route.wall_id)
        .where(Clip.id == clip, Wall.gym_id == gym, Clip.film_size.is_not(None))
    )
    row = session.scalar(wanted)
    if row is not None and row.person_id == person:
        return row
    if row is None or row.published_at is None or session.scalar(select(_is_banned(gym, row))):
        raise NotFoundError("not-there-film")
    return row


def _is_banned(gym: UUID, clip: Clip | type[Clip] = Clip) -> ColumnElement[bool]:
    return exists().where(Ban.gym_id == gym, Ban.person_id == clip.person_id)


def forget_old_films(session: Session) -> None:
    """Forget films that nobody published in time."""
    before = now() - timedelta(days=KEPT_DAYS)
    waiting = select(Clip).where(Clip.film_size.is_not(None), Clip.published_at.is_(None))
    for clip in session.scalars(waiting.where(Clip.created_at < before)):
        remove_film(session, clip)

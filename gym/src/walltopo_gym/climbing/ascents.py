"""Ascents as they arrive. Each is stored once, however often it is sent."""

from __future__ import annotations

from collections.abc import Iterable
from datetime import UTC, datetime
from typing import Annotated, Any, Final
from uuid import UUID
from zoneinfo import ZoneInfo

from pydantic import Field
from sqlalchemy.orm import Session

from walltopo_gym.accounts.people import lock_person
from walltopo_gym.api.fields import Body, Moment
from walltopo_gym.climbing.counting import count_again, value_ascent
from walltopo_gym.climbing.dates import begin_of, check_climbed
from walltopo_gym.climbing.edits import Edit, is_newer_edit
from walltopo_gym.climbing.kinds import FIRST_TRIES, Kind, kinds_of
from walltopo_gym.climbing.models import Ascent
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, NotFoundError, RequestError
from walltopo_gym.events import AscentsChanged, publish_event
from walltopo_gym.gyms.days import zone_of
from walltopo_gym.gyms.models import Gym
from walltopo_gym.publishing.models import Route
from walltopo_gym.walls.disciplines import Discipline

Clip = Annotated[int, Field(ge=1, le=99)]
Words = Annotated[str, Field(max_length=500, pattern=r"^[^\x00-\x08\x0b-\x1f\x7f]*$")]


class EditOriginIn(Body):
    """The origin of an edit, by which late copies of older edits are ignored. `number` grows with
    each edit of the device; `age_s` is the edit's age when it is sent, by the device's clock."""

    device: UUID
    number: int = Field(ge=1, le=2**53)
    age_s: float = Field(0, ge=0, le=1e9)

    def read(self) -> Edit:
        """Return the edit as the services use it."""
        return Edit(self.device, self.number, self.age_s)


class Climb(Body):
    """An ascent of a route: `tries` of that day, `climbed_at` by the climber's clock.

    Without `discipline` it is the first that the route has. `high_point`: number of the highest
    clip, for that kind alone.
    """

    route_id: UUID
    kind: Kind
    tries: int = Field(1, ge=1, le=999)
    discipline: Discipline | None = None
    high_point: Clip | None = None
    climbed_at: Moment
    note: Words = ""


class NewAscent(Climb):
    """An ascent of a route and the origin of the edit."""

    edit: EditOriginIn | None = None


class IdentifiedClimb(Climb):
    """An ascent of a route under the id that the phone made."""

    id: UUID


def store_ascent(
    session: Session,
    ascent: UUID,
    person: UUID,
    gym: Gym,
    route: Route,
    climb: Climb,
    edit: Edit | None = None,
) -> tuple[Ascent, bool]:
    """Store or correct an ascent; return it and whether it is new.

    A time of the next hours counts as now, because clocks differ. A withdrawn ascent stays
    withdrawn, and a newer edit stays.

    Raises
    ------
    RequestError : a flash in several tries, a kind that the discipline does not have, a discipline
        that the route does not have, or a new time at which the route was not there.
    ConflictError : the id belongs to another person.
    """
    stored = _store_ascents(session, person, gym, [(ascent, route, climb)], edit)
    return stored[0]


def store_ascents(
    session: Session,
    person: UUID,
    gym: Gym,
    climbs: Iterable[tuple[Route, IdentifiedClimb]],
    edit: Edit | None,
) -> list[Ascent]:
    """Store or correct several ascents, all or none, as `store_ascent` does with each."""
    named = ((climb.id, route, climb) for route, climb in climbs)
    return [row for row, _ in _store_ascents(session, person, gym, named, edit)]


def _store_ascents(
    session: Session,
    person: UUID,
    gym: Gym,
    climbs: Iterable[tuple[UUID, Route, Climb]],
    edit: Edit | None,
) -> list[tuple[Ascent, bool]]:
    """Store ascents by their ids; return each with whether it is new. They are counted once."""
    lock_person(session, person)
    rows, moments = [], set[datetime]()
    for ascent, route, climb in climbs:
        row, changed, is_new = _write_ascent(session, ascent, person, gym, route, climb, edit)
        session.flush()  # an id may come twice
        rows.append((row, is_new))
        moments |= changed
    if moments:
        count_again(session, gym, person, moments)
        _publish_change(session, gym, [row for row, _ in rows])
    return rows


def _publish_change(session: Session, gym: Gym, ascents: Iterable[Ascent]) -> None:
    routes = frozenset(row.route_id for row in ascents if row.route_id is not None)
    publish_event(session, AscentsChanged(gym.id, routes))


def _write_ascent(
    session: Session,
    ascent: UUID,
    person: UUID,
    gym: Gym,
    route: Route,
    climb: Climb,
    edit: Edit | None,
) -> tuple[Ascent, set[datetime], bool]:
    """Write an ascent; return it, the moments to count again, and whether it is new."""
    row = session.get(Ascent, ascent)
    is_new = row is None
    discipline = _discipline_of(route, row, climb.discipline)
    _check_kind(climb.kind, climb.tries, discipline, climb.high_point)
    if row is None or row.climbed_at != climb.climbed_at:
        check_climbed(climb.climbed_at, begin_of(session, gym, route), zone_of(gym))
    if row is None:
        row = new_ascent(person, gym, route, id=ascent)
        value_ascent(session, row, route)
        session.add(row)
    elif row.person_id != person:
        raise ConflictError("id-taken", "id-another")
    elif row.taken_back_at is not None:
        return row, set(), False
    elif row.route_id != route.id:
        raise ConflictError("ascent-other-route", "ascent-make-new")
    if not is_newer_edit(row, edit):
        return row, set(), False
    before = set() if is_new else {row.climbed_at}
    row.kind, row.tries, row.note = climb.kind, climb.tries, climb.note
    row.discipline, row.high_point = discipline, climb.high_point
    row.climbed_at = min(climb.climbed_at, now())
    return row, before | {row.climbed_at}, is_new


def new_ascent(person: UUID, gym: Gym, route: Route, **facts: Any) -> Ascent:
    """Return an ascent with the names and the grade that gym and route have now.

    Parameters
    ----------
    facts : other columns of `Ascent`.
    """
    return Ascent(
        person_id=person,
        gym_id=gym.id,
        route_id=route.id,
        gym_name=gym.name,
        route_name=route.name,
        grade=route.grade,
        **facts,
    )


class AscentChange(Body):
    """Changes of an ascent; omitted fields stay."""

    kind: Kind | None = None
    tries: int | None = Field(None, ge=1, le=999)
    discipline: Discipline | None = None
    high_point: Clip | None = None
    climbed_at: Moment | None = None
    note: Words | None = None


def correct_ascent(session: Session, ascent: UUID, person: UUID, change: AscentChange) -> Ascent:
    """Correct an ascent of any gym, also after its route, its gym or the membership is gone.

    A change to a flash or an onsight without a number of tries counts as one try.

    Raises
    ------
    NotFoundError : this person has no ascent with that id. RequestError : as in `store_ascent`.
    """
    lock_person(session, person)
    row = own_ascent(session, ascent, person)
    kind = change.kind or Kind(row.kind)
    tries = change.tries or (1 if kind in FIRST_TRIES else row.tries)
    gym = None if row.gym_id is None else session.get(Gym, row.gym_id)
    route = None if row.route_id is None else session.get(Route, row.route_id)
    discipline = _discipline_of(route, row, change.discipline)
    high_point = change.high_point or (row.high_point if kind == Kind.HIGH_POINT else None)
    _check_kind(kind, tries, discipline, high_point)
    at = change.climbed_at or row.climbed_at
    if at != row.climbed_at:
        begin = _EVER if gym is None or route is None else begin_of(session, gym, route)
        check_climbed(at, begin, ZoneInfo("UTC") if gym is None else zone_of(gym))
    is_newer_edit(row, None)
    before, row.climbed_at = row.climbed_at, min(at, now())
    row.kind, row.tries = kind, tries
    row.discipline, row.high_point = discipline, high_point
    row.note = row.note if change.note is None else change.note
    if gym is not None:
        count_again(session, gym, person, {before, row.climbed_at})
        _publish_change(session, gym, [row])
    return row


# The begin of a route that is gone: any day is accepted.
_EVER: Final = datetime(1900, 1, 3, tzinfo=UTC)


def own_ascent(session: Session, ascent: UUID, person: UUID, *, withdrawn: bool = False) -> Ascent:
    """Return an ascent of a person.

    Parameters
    ----------
    withdrawn : also one that the person has withdrawn.

    Raises
    ------
    NotFoundError : this person has no such ascent.
    """
    row = session.get(Ascent, ascent)
    if row is None or row.person_id != person or not (withdrawn or row.taken_back_at is None):
        raise NotFoundError("not-there-ascent")
    return row


def _discipline_of(
    route: Route | None, row: Ascent | None, wanted: Discipline | None
) -> Discipline:
    """Return the discipline of an ascent: the wanted one, the stored one, or the route's first.

    Raises
    ------
    RequestError : the route is not climbed so.
    """
    if row is not None and wanted in (None, row.discipline):
        return Discipline(row.discipline)
    has = [Discipline.BOULDER] if route is None else route.disciplines
    if wanted is not None and wanted not in has:
        raise RequestError("ascent-discipline", discipline=wanted, has=", ".join(has))
    return wanted or has[0]


def _check_kind(kind: Kind, tries: int, discipline: Discipline, high_point: int | None) -> None:
    """Raise RequestError for a first try in several tries, a kind that the discipline does not
    have, or a high point without its clip."""
    if kind in FIRST_TRIES and tries != 1:
        raise RequestError("flash-one-try", tries=tries)
    if kind not in kinds_of(discipline):
        raise RequestError("ascent-kind", kind=kind, discipline=discipline)
    if (kind == Kind.HIGH_POINT) != (high_point is not None):
        raise RequestError("ascent-high-point")


def withdraw(session: Session, ascent: UUID, person: UUID) -> None:
    """Withdraw an ascent; repeating it is fine.

    Raises
    ------
    NotFoundError : this person has no ascent with that id.
    """
    lock_person(session, person)
    row = own_ascent(session, ascent, person, withdrawn=True)
    if row.taken_back_at is None:
        row.taken_back_at = now()
        if row.gym_id is not None:
            gym = session.get_one(Gym, row.gym_id)
            count_again(session, gym, person, [row.climbed_at])
            _publish_change(session, gym, [row])

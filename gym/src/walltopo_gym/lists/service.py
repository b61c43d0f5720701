"""Store lists, find the ones that a person sees, and count what people climbed of them."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Final
from uuid import UUID

from sqlalchemy import Select, and_, exists, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.limits import count_list
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.people import lock_person
from walltopo_gym.climbing.edits import Edit, is_newer_edit
from walltopo_gym.climbing.sharing import Share, may_see, not_hidden
from walltopo_gym.clock import now
from walltopo_gym.errors import ConflictError, ForbiddenError, NotFoundError, RequestError
from walltopo_gym.events import ClimbedBy, ClimbsById, ListedClimb, collect_answers
from walltopo_gym.gyms.models import Gym, Membership
from walltopo_gym.lists.models import ClimbList, ListMember

MAX_ITEMS: Final = 100


@dataclass(frozen=True)
class Viewer:
    """The person for whom lists are read; `person` is None for guests."""

    person: UUID | None
    is_member: bool
    is_setter: bool


@dataclass(frozen=True)
class ListDraft:
    """A list as its author has it; the columns of `ClimbList` say what the fields are."""

    name: str
    note: str
    share: Share
    circuit: bool
    items: Sequence[UUID]


def store_list(
    session: Session, key: UUID, gym: Gym, author: Viewer, draft: ListDraft, edit: Edit | None
) -> tuple[ClimbList, bool]:
    """Store or change a member's list; return it and whether it is new.

    A deleted list stays deleted, and a newer edit stays. Routes and problems that are gone since
    may stay in the list.

    Raises
    ------
    RequestError : an item comes twice, or is not a climb of this gym that the author sees.
    ForbiddenError : a circuit by a person who is not a setter.
    ConflictError : the id belongs to another person or gym. TooManyError : the limit of a day.
    """
    assert author.person is not None
    lock_person(session, author.person)
    row = session.get(ClimbList, key)
    if row is not None and (row.person_id != author.person or row.gym_id != gym.id):
        raise ConflictError("id-taken", "id-another")
    if row is not None and row.deleted_at is not None:
        return row, False
    if draft.circuit and not author.is_setter:
        raise ForbiddenError("list-circuit-setter")
    _check_items(session, gym.id, author, draft.items, [] if row is None else row.items)
    is_new = row is None
    if row is None:
        count_list(session, author.person)
        row = ClimbList(id=key, gym_id=gym.id, person_id=author.person)
    if is_newer_edit(row, edit):
        row.name, row.note, row.share = draft.name, draft.note, draft.share.value
        row.circuit, row.items = draft.circuit, [str(item) for item in draft.items]
    session.add(row)
    session.flush()
    return row, is_new


def _check_items(
    session: Session, gym: UUID, author: Viewer, items: Sequence[UUID], before: Iterable[str]
) -> None:
    if len(set(items)) < len(items):
        raise RequestError("list-item-twice")
    new = [item for item in items if str(item) not in set(before)]
    if len(listed_climbs(session, gym, author, new)) < len(new):
        raise RequestError("list-item-unknown")


def list_of(session: Session, gym: UUID, key: UUID, viewer: Viewer) -> ClimbList:
    """Return a list of this gym that the viewer may see.

    Raises
    ------
    NotFoundError : there is none, or it is not for this person.
    """
    row = session.get(ClimbList, key)
    if (
        row is None
        or row.gym_id != gym
        or row.deleted_at is not None
        or not may_see(row, viewer.person, is_member=viewer.is_member, is_setter=viewer.is_setter)
    ):
        raise NotFoundError("not-there-list")
    return row


def lists_shown(gym: UUID, viewer: Viewer) -> Select[ClimbList]:
    """Return the query of the lists that a member finds in a gym: those for all members, one's own,
    and those that one does."""
    rows = select(ClimbList).where(ClimbList.gym_id == gym, ClimbList.deleted_at.is_(None))
    shared = ClimbList.share == Share.GYM
    joined = and_(
        ClimbList.share != Share.PRIVATE,
        exists().where(ListMember.list_id == ClimbList.id, ListMember.person_id == viewer.person),
    )
    others = and_(or_(shared, joined), not_hidden(ClimbList, gym, is_setter=viewer.is_setter))
    return rows.where(or_(others, ClimbList.person_id == viewer.person))


def listed_climbs(
    session: Session, gym: UUID, viewer: Viewer, items: Iterable[UUID]
) -> dict[UUID, ListedClimb]:
    """Return those of these routes and problems that exist in the gym and the viewer may see."""
    ids = frozenset(items)
    if not ids:
        return {}
    question = ClimbsById(
        gym, ids, viewer.person, is_member=viewer.is_member, is_setter=viewer.is_setter
    )
    return {climb.id: climb for climb in collect_answers(session, question)}


def own_climbs(session: Session, viewer: Viewer, items: Iterable[UUID]) -> dict[UUID, datetime]:
    """Return when the viewer first climbed those of these items that they climbed."""
    if viewer.person is None:
        return {}
    return climbed_by(session, items, [viewer.person]).get(viewer.person, {})


def climbed_by(
    session: Session, items: Iterable[UUID], people: Iterable[UUID]
) -> dict[UUID, dict[UUID, datetime]]:
    """Return by person when each first climbed those of these items that they climbed."""
    question = ClimbedBy(frozenset(items), frozenset(people))
    found: dict[UUID, dict[UUID, datetime]] = defaultdict(dict)
    if question.climbs and question.people:
        for person, climb, at in collect_answers(session, question):
            found[person][climb] = at
    return found


def delete_list(session: Session, row: ClimbList) -> None:
    """Delete a list for all but late copies of its edits; its words and items go."""
    row.deleted_at, row.name, row.note, row.items = now(), "", "", []


def join_list(session: Session, row: ClimbList, person: UUID, *, shows_progress: bool) -> None:
    """Note that a person does a list, and whether its author sees their progress."""
    member = session.get(ListMember, (row.id, person)) or ListMember(
        list_id=row.id, person_id=person
    )
    member.shows_progress = shows_progress
    session.add(member)


def leave_list(session: Session, row: ClimbList, person: UUID) -> None:
    """Note that a person does a list no longer; repeating it is fine."""
    member = session.get(ListMember, (row.id, person))
    if member is not None:
        session.delete(member)


@dataclass(frozen=True)
class Progress:
    """The climbs that a person has done of a list, with the moment of the first time."""

    person: UUID
    name: str
    climbed: dict[UUID, datetime]


def group_progress(session: Session, row: ClimbList) -> list[Progress]:
    """Return the progress of the members who show it to the list's author, by name."""
    people = (
        select(Person.id, Person.name)
        .join(ListMember, ListMember.person_id == Person.id)
        .join(Membership, Membership.person_id == Person.id)
        .where(ListMember.list_id == row.id, ListMember.shows_progress)
        .where(Membership.gym_id == row.gym_id)
        .order_by(Person.name, Person.id)
    )
    names = dict(session.execute(people).all())
    climbed = climbed_by(session, map(UUID, row.items), names)
    return [Progress(person, name, climbed.get(person, {})) for person, name in names.items()]

"""Endpoints of lists, of the people who do them, and of their moderation."""

from __future__ import annotations

from collections.abc import Container
from datetime import datetime
from typing import Annotated, Final, Literal
from uuid import UUID

from fastapi import APIRouter, Response
from pydantic import BaseModel, Field
from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.access import SignedInMay
from walltopo_gym.accounts.actor import Scope
from walltopo_gym.accounts.people import names_by_id
from walltopo_gym.api.fields import Body, Name, Note
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.climbing.ascents import EditOriginIn
from walltopo_gym.climbing.sharing import Share
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError
from walltopo_gym.gyms.access import Access, GuestMay, SetterMay, gym_rule
from walltopo_gym.gyms.members import check_not_banned
from walltopo_gym.gyms.roles import Role
from walltopo_gym.lists.models import ClimbList, ListMember
from walltopo_gym.lists.service import (
    MAX_ITEMS,
    ListDraft,
    Viewer,
    delete_list,
    group_progress,
    join_list,
    leave_list,
    list_of,
    listed_climbs,
    lists_shown,
    own_climbs,
    store_list,
)

router = APIRouter(tags=["lists"])

ClimberMay = Annotated[Access, gym_rule(Role.MEMBER, None)]
ReaderMay = Annotated[Access, gym_rule(Role.MEMBER, Scope.READ)]


class NewList(Body):
    """A complete list; `items` are ids of routes and problems of the gym, in their order."""

    name: Name
    note: Note = ""
    share: Share = Share.PRIVATE
    circuit: bool = False
    items: Annotated[list[UUID], Field(max_length=MAX_ITEMS)]
    edit: EditOriginIn | None = None


class ListSummary(BaseModel):
    """A list in a table of lists. `climbs`: ids of its items in their order; `climbed`: number of
    those that one has climbed. `author` is empty for people who are not members. `joined`: one does
    it. `shows_progress`: its author sees one's progress. `hidden`: only its author and setters see
    it.
    """

    id: UUID
    name: str
    note: str
    share: Share
    circuit: bool
    author_id: UUID | None
    author: str
    climbs: list[UUID]
    climbed: int
    joined: bool
    shows_progress: bool
    hidden: bool
    created_at: datetime


class ListItem(BaseModel):
    """A route or problem of a list, as it is now. `kind` is "gone" if it is deleted or not for
    everyone. `current`: it can be climbed. `number`: of a route in the published version."""

    id: UUID
    kind: Literal["route", "problem", "gone"]
    wall_id: UUID | None = None
    name: str = ""
    colour: str = ""
    grade_system_id: UUID | None = None
    grade: str = ""
    number: int | None = None
    current: bool = False
    climbed_at: datetime | None = None


class ListOut(ListSummary):
    """A list with its items in their order."""

    items: list[ListItem]


@router.put("/gyms/{gym}/lists/{list_id}")
def put_list(
    list_id: UUID, body: NewList, response: Response, session: Db, access: ClimberMay
) -> ListOut:
    """Store a list under an id that the phone made, so that it is stored once. Sending it again
    with other fields changes it. A deleted list stays deleted. The response is the stored state: a
    late copy of an older `edit` changes nothing."""
    check_not_banned(session, access.gym.id, access.actor.known)
    draft = ListDraft(body.name, body.note, body.share, body.circuit, body.items)
    edit = body.edit.read() if body.edit else None
    row, is_new = store_list(session, list_id, access.gym, _viewer(access), draft, edit)
    response.status_code = 201 if is_new else 200
    return _list_out(session, access, row)


@router.get("/gyms/{gym}/lists")
def list_lists(
    session: Db, access: ReaderMay, cursor: Cursor = None, size: Size = 50
) -> Page[ListSummary]:
    """Return the lists for all members, one's own, and those that one does, the newest first."""
    rows = lists_shown(access.gym.id, _viewer(access))
    page, following = page_of(session, rows, ClimbList, cursor, size)
    items = {UUID(item) for row in page for item in row.items}
    climbed = own_climbs(session, _viewer(access), items)
    return Page(items=_list_summaries(session, access, page, climbed), next=following)


@router.get("/gyms/{gym}/lists/{list_id}")
def read_list(list_id: UUID, session: Db, access: GuestMay) -> ListOut:
    """Return a list; one that is shared by link also for people who are not members."""
    return _list_out(session, access, _list(session, access, list_id))


@router.delete("/me/lists/{list_id}", status_code=204)
def drop_list(list_id: UUID, session: Db, actor: SignedInMay) -> None:
    """Delete one's own list; repeating it is fine."""
    row = session.get(ClimbList, list_id)
    if row is None or row.person_id != actor.known:
        raise NotFoundError("not-there-list")
    delete_list(session, row)


class Joining(Body):
    """`shows_progress`: the list's author may see which of its climbs one has done."""

    shows_progress: bool = False


@router.put("/gyms/{gym}/lists/{list_id}/joined", status_code=204)
def put_list_joined(list_id: UUID, body: Joining, session: Db, access: ClimberMay) -> None:
    """Do a list: it stays among one's lists. Sending it again changes the consent."""
    row = _list(session, access, list_id)
    join_list(session, row, access.actor.known, shows_progress=body.shows_progress)


@router.delete("/gyms/{gym}/lists/{list_id}/joined", status_code=204)
def drop_list_joined(list_id: UUID, session: Db, access: ClimberMay) -> None:
    """Do a list no longer; its author sees nothing more. Repeating it is fine."""
    row = session.get(ClimbList, list_id)
    if row is None or row.gym_id != access.gym.id:
        raise NotFoundError("not-there-list")
    leave_list(session, row, access.actor.known)


class ProgressOf(BaseModel):
    """The items of a list that a member who consented has climbed."""

    person_id: UUID
    name: str
    climbed: list[UUID]


@router.get("/gyms/{gym}/lists/{list_id}/progress")
def read_list_progress(list_id: UUID, session: Db, access: ReaderMay) -> list[ProgressOf]:
    """Return the progress of those who show it to the list's author; for the author alone."""
    row = _list(session, access, list_id)
    if row.person_id != access.actor.known:
        raise NotFoundError("not-there-list")
    return [
        ProgressOf(person_id=one.person, name=one.name, climbed=list(one.climbed))
        for one in group_progress(session, row)
    ]


@router.put("/gyms/{gym}/lists/{list_id}/hidden", status_code=204)
def hide_list(list_id: UUID, session: Db, access: SetterMay) -> None:
    """Hide a list from all but its author and setters; repeating it is fine."""
    row = _list(session, access, list_id)
    if row.hidden_at is None:
        row.hidden_at = now()
        access.log_change(session, "list.hide", str(row.id))


@router.delete("/gyms/{gym}/lists/{list_id}/hidden", status_code=204)
def show_list(list_id: UUID, session: Db, access: SetterMay) -> None:
    """Show a hidden list again; repeating it is fine."""
    row = _list(session, access, list_id)
    if row.hidden_at is not None:
        row.hidden_at = None
        access.log_change(session, "list.show", str(row.id))


def _viewer(access: Access) -> Viewer:
    return Viewer(
        access.actor.person,
        is_member=access.role.covers(Role.MEMBER),
        is_setter=access.role.covers(Role.SETTER),
    )


def _list(session: Session, access: Access, key: UUID) -> ClimbList:
    return list_of(session, access.gym.id, key, _viewer(access))


def _list_summaries(
    session: Session, access: Access, rows: list[ClimbList], climbed: Container[UUID]
) -> list[ListSummary]:
    """Return rows of a table; `climbed`: the items that one has climbed."""
    viewer = _viewer(access)
    authors = (row.person_id for row in rows)
    names = names_by_id(session, authors) if viewer.is_member else {}
    mine = select(ListMember.list_id, ListMember.shows_progress).where(
        ListMember.person_id == viewer.person, ListMember.list_id.in_([row.id for row in rows])
    )
    joined = dict(session.execute(mine).all())
    return [
        ListSummary(
            id=row.id,
            name=row.name,
            note=row.note,
            share=Share(row.share),
            circuit=row.circuit,
            author_id=row.person_id if viewer.is_member else None,
            author=names.get(row.person_id, ""),
            climbs=[UUID(item) for item in row.items],
            climbed=sum(UUID(item) in climbed for item in row.items),
            joined=row.id in joined,
            shows_progress=joined.get(row.id, False),
            hidden=row.hidden_at is not None,
            created_at=row.created_at,
        )
        for row in rows
    ]


def _list_out(session: Session, access: Access, row: ClimbList) -> ListOut:
    viewer = _viewer(access)
    ids = [UUID(item) for item in row.items]
    climbed = own_climbs(session, viewer, ids)
    [summary] = _list_summaries(session, access, [row], climbed)
    climbs = listed_climbs(session, access.gym.id, viewer, ids)
    items = [
        ListItem(id=item, kind="gone")
        if (climb := climbs.get(item)) is None
        else ListItem(**vars(climb), climbed_at=climbed.get(item))
        for item in ids
    ]
    return ListOut(**summary.model_dump(), items=items)


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

"""Endpoints of the operator's view of accounts."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Any
from uuid import UUID

from fastapi import APIRouter, Query, Response
from pydantic import BaseModel, EmailStr

from walltopo_gym.accounts.access import OperatorMay
from walltopo_gym.accounts.models import Person
from walltopo_gym.accounts.notices import NotifyOwner
from walltopo_gym.api.fields import Body, Text
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.operating.users import (
    delete_user,
    export_user,
    facts_of,
    lock_user,
    reset_second_factor,
    sign_out_user,
    unlock_user,
    user_of,
    users_named,
)

router = APIRouter(prefix="/operator", tags=["operator"])


class UserRoleOut(BaseModel):
    """A role in a gym; `gym` is its slug."""

    gym: str
    role: str


class UserOut(BaseModel):
    """An account; `browsers`: in how many the person is signed in."""

    id: UUID
    email: str
    name: str
    created_at: datetime
    operator: bool
    locked_at: datetime | None
    second_factor: bool
    browsers: int
    gyms: list[UserRoleOut]


class UserDeletion(Body):
    """The address of the account, typed for confirmation."""

    email: EmailStr


Search = Annotated[Text, Query(description="part of the name or of the address")]


@router.get("/users")
def list_users(
    session: Db, actor: OperatorMay, search: Search = "", cursor: Cursor = None, size: Size = 25
) -> Page[UserOut]:
    """Return the accounts whose name or address contains a text, the newest first."""
    rows, following = page_of(session, users_named(search.strip()), Person, cursor, size)
    facts = facts_of(session, [row.id for row in rows])
    items = [
        UserOut.model_validate(
            {
                "id": row.id,
                "email": row.email,
                "name": row.name,
                "created_at": row.created_at,
                "operator": row.operator,
                "locked_at": row.locked_at,
                **vars(facts[row.id]),
            },
            from_attributes=True,
        )
        for row in rows
    ]
    return Page(items=items, next=following)


@router.put("/users/{person}/lock", status_code=204)
def lock_account(person: UUID, session: Db, notify: NotifyOwner, actor: OperatorMay) -> None:
    """Lock an account. Its owner gets a mail."""
    lock_user(session, person, actor.known)
    notify(session, person, "account-locked")


@router.delete("/users/{person}/lock", status_code=204)
def unlock_account(person: UUID, session: Db, notify: NotifyOwner, actor: OperatorMay) -> None:
    """Unlock an account. Its owner gets a mail."""
    unlock_user(session, person, actor.known)
    notify(session, person, "account-unlocked")


@router.post("/users/{person}/sign-out", status_code=204)
def sign_out_account(person: UUID, session: Db, notify: NotifyOwner, actor: OperatorMay) -> None:
    """Sign an account out everywhere. Its owner gets a mail."""
    sign_out_user(session, person, actor.known)
    notify(session, person, "signed-out")


@router.post("/users/{person}/second-factor/reset", status_code=204)
def reset_account_factor(
    person: UUID, session: Db, notify: NotifyOwner, actor: OperatorMay
) -> None:
    """Turn the second factor of an account off. Its owner gets a mail."""
    reset_second_factor(session, person, actor.known)
    notify(session, person, "second-factor-reset")


@router.post("/users/{person}/data")
def export_account(
    person: UUID, response: Response, session: Db, notify: NotifyOwner, actor: OperatorMay
) -> dict[str, Any]:
    """Return all data of an account. Its owner gets a mail."""
    response.headers["content-disposition"] = 'attachment; filename="walltopo.json"'
    data = export_user(session, person, actor.known)
    notify(session, person, "data-exported")
    return data


@router.post("/users/{person}/delete", status_code=204)
def delete_user_account(
    person: UUID, body: UserDeletion, session: Db, notify: NotifyOwner, actor: OperatorMay
) -> None:
    """Delete an account with all of its data. Its owner gets a mail."""
    user_of(session, person)
    notify(session, person, "account-deleted")
    delete_user(session, person, body.email, actor.known)

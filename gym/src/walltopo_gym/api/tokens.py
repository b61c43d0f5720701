"""Tokens for programs."""

from __future__ import annotations

from datetime import datetime, timedelta
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import delete, select

from walltopo_gym.accounts.actor import TOKEN_PREFIX, Scope
from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import ApiToken
from walltopo_gym.accounts.secrets import new_secret
from walltopo_gym.api.fields import Body, Name
from walltopo_gym.api.rules import SignedInMay
from walltopo_gym.api.services import Db
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError

router = APIRouter(tags=["accounts"])


class NewToken(Body):
    """A token for a program."""

    name: Name
    scopes: list[Scope] = Field(min_length=1, max_length=len(Scope))
    days: int = Field(365, ge=1, le=730)


class Token(BaseModel):
    """A token without its secret."""

    id: UUID
    name: str
    scopes: list[str]
    created_at: datetime
    expires_at: datetime


class MadeToken(Token):
    """A token just made: its secret is told this once."""

    secret: str


@router.get("/me/tokens")
def list_tokens(session: Db, actor: SignedInMay) -> list[Token]:
    """One's tokens for programs."""
    rows = session.scalars(
        select(ApiToken).where(ApiToken.person_id == actor.known).order_by(ApiToken.created_at)
    )
    return [Token.model_validate(row, from_attributes=True) for row in rows]


@router.post("/me/tokens", status_code=201)
def make_token(body: NewToken, session: Db, actor: SignedInMay) -> MadeToken:
    """Make a token for a program."""
    secret, kept = new_secret(TOKEN_PREFIX)
    scopes = sorted({scope.value for scope in body.scopes})
    row = ApiToken(person_id=actor.known, name=body.name, token_hash=kept, scopes=scopes,
                   expires_at=now() + timedelta(days=body.days))  # fmt: skip
    session.add(row)
    session.flush()
    log_change(session, "token.create", person=actor.known, subject=str(row.id))
    told = Token.model_validate(row, from_attributes=True)
    return MadeToken(**told.model_dump(), secret=secret)


@router.delete("/me/tokens/{token}", status_code=204)
def drop_token(token: UUID, session: Db, actor: SignedInMay) -> None:
    """End a token."""
    ended = delete(ApiToken).where(ApiToken.id == token, ApiToken.person_id == actor.known)
    if session.execute(ended.returning(ApiToken.id)).one_or_none() is None:
        raise NotFoundError("no such token")
    log_change(session, "token.delete", person=actor.known, subject=str(token))

"""Endpoints of announcements."""

from __future__ import annotations

from datetime import datetime
from typing import Annotated, Final
from uuid import UUID

from fastapi import APIRouter
from pydantic import BaseModel, Field
from sqlalchemy import select

from walltopo_gym.accounts.access import AnyoneMay, OperatorMay
from walltopo_gym.announcements.models import Announcement
from walltopo_gym.announcements.service import (
    current_announcements,
    drop_announcement,
    make_announcement,
)
from walltopo_gym.api.fields import Body, LongText, Moment
from walltopo_gym.api.paging import Cursor, Page, Size, page_of
from walltopo_gym.api.services import Db
from walltopo_gym.languages import Language

router = APIRouter(tags=["announcements"])

AnnouncementText = Annotated[str, Field(max_length=500, pattern=LongText)]


class AnnouncementOut(BaseModel):
    """An announcement that is shown now; `texts` by language."""

    id: UUID
    texts: dict[Language, str]


class OperatorAnnouncementOut(AnnouncementOut):
    """An announcement with its time; `ends_at` null: without an end."""

    starts_at: datetime
    ends_at: datetime | None


class NewAnnouncement(Body):
    """The texts by language, at least one; `starts_at` null: now, `ends_at` null: no end."""

    texts: dict[Language, AnnouncementText] = Field(min_length=1, max_length=4)
    starts_at: Moment | None = None
    ends_at: Moment | None = None


@router.get("/announcements")
def list_announcements(session: Db, actor: AnyoneMay) -> list[AnnouncementOut]:
    """Return the announcements that are shown now, at most five."""
    rows = current_announcements(session)
    return [AnnouncementOut.model_validate(row, from_attributes=True) for row in rows]


@router.get("/operator/announcements")
def list_operator_announcements(
    session: Db, actor: OperatorMay, cursor: Cursor = None, size: Size = 50
) -> Page[OperatorAnnouncementOut]:
    """Return all announcements, the newest first."""
    rows, following = page_of(session, select(Announcement), Announcement, cursor, size)
    items = [OperatorAnnouncementOut.model_validate(row, from_attributes=True) for row in rows]
    return Page(items=items, next=following)


@router.post("/operator/announcements", status_code=201)
def announce(body: NewAnnouncement, session: Db, actor: OperatorMay) -> OperatorAnnouncementOut:
    """Add an announcement."""
    row = make_announcement(session, body.texts, body.starts_at, body.ends_at, actor.known)
    return OperatorAnnouncementOut.model_validate(row, from_attributes=True)


@router.delete("/operator/announcements/{announcement}", status_code=204)
def withdraw_announcement(announcement: UUID, session: Db, actor: OperatorMay) -> None:
    """Delete an announcement."""
    drop_announcement(session, announcement, actor.known)


ROUTERS: Final[tuple[APIRouter, ...]] = (router,)

"""Announcements: which are shown now, making and deleting them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta
from typing import Final
from uuid import UUID

from sqlalchemy import delete, or_, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.announcements.models import Announcement
from walltopo_gym.clock import now
from walltopo_gym.errors import NotFoundError, RequestError
from walltopo_gym.events import RowsExpired
from walltopo_gym.languages import Language

_SHOWN: Final = 5  # at a time
_KEPT: Final = timedelta(days=365)  # after its end


def current_announcements(session: Session) -> Sequence[Announcement]:
    """Return the announcements that are shown now, the latest first."""
    ends = or_(Announcement.ends_at.is_(None), Announcement.ends_at > now())
    wanted = select(Announcement).where(Announcement.starts_at <= now(), ends)
    return session.scalars(wanted.order_by(Announcement.starts_at.desc()).limit(_SHOWN)).all()


def make_announcement(
    session: Session,
    texts: Mapping[Language, str],
    starts_at: datetime | None,
    ends_at: datetime | None,
    by: UUID | None,
) -> Announcement:
    """Add an announcement.

    Parameters
    ----------
    texts : by language. starts_at : None: now. ends_at : None: until it is deleted.
    by : the operator; None: by command.

    Raises
    ------
    RequestError : there is no text, or the end comes first.
    """
    starts = starts_at or now()
    given = {language: text.strip() for language, text in texts.items() if text.strip()}
    if not given:
        raise RequestError("announcement-empty")
    if ends_at is not None and ends_at <= starts:
        raise RequestError("announcement-ends-first")
    row = Announcement(texts=given, starts_at=starts, ends_at=ends_at)
    session.add(row)
    session.flush()
    log_change(session, "announcement.make", person=by, subject=str(row.id))
    return row


def drop_announcement(session: Session, announcement: UUID, by: UUID | None) -> None:
    """Delete an announcement.

    Parameters
    ----------
    by : the operator; None: by command.

    Raises
    ------
    NotFoundError : there is no such announcement.
    """
    row = session.get(Announcement, announcement)
    if row is None:
        raise NotFoundError("not-there-announcement")
    session.delete(row)
    log_change(session, "announcement.drop", person=by, subject=str(announcement))


def drop_old_announcements(session: Session, question: RowsExpired) -> None:
    """Delete the announcements that ended long ago."""
    old = delete(Announcement).where(Announcement.ends_at < now() - _KEPT)
    question.found.append(len(session.scalars(old.returning(Announcement.id)).all()))

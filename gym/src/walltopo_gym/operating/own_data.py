"""Export and deletion of a person's data."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final
from uuid import UUID

from sqlalchemy import Select, delete, func, inspect, select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.accounts.models import (
    ApiToken,
    AuditEntry,
    Identity,
    KnownBrowser,
    MailedLink,
    Passkey,
    Person,
    Profile,
    RecoveryCode,
    SecondFactor,
    SignIn,
)
from walltopo_gym.climbing.follows import followers, following
from walltopo_gym.climbing.models import (
    Ascent,
    ClimbingSession,
    HiddenComment,
    Opinion,
    Report,
    SessionMark,
    Standing,
)
from walltopo_gym.errors import ConflictError
from walltopo_gym.events import OwnTables, PersonDeleted, collect_answers, publish_event
from walltopo_gym.gyms.models import Ban, Gym, Membership
from walltopo_gym.gyms.roles import Role
from walltopo_gym.spreadsheets import CsvDialect, csv_table

# Every table of the core that names a person, and what of it is secret or of no meaning to them.
_KINDS: Final[dict[str, Any]] = {
    "profile": Profile,
    "gyms": Membership,
    "ascents": Ascent,
    "opinions": Opinion,
    "sessions": ClimbingSession,
    "session_marks": SessionMark,
    "standings": Standing,
    "hidden_comments": HiddenComment,
    "reports": Report,
    "bans": Ban,
    "sign_ins": SignIn,
    "browsers": KnownBrowser,
    "tokens": ApiToken,
    "passkeys": Passkey,
    "second_factor": SecondFactor,
    "recovery_codes": RecoveryCode,
    "identities": Identity,
    "changes": AuditEntry,
}
_LEFT_OUT: Final = {
    "password_hash",
    "token_hash",
    "public_key",
    "credential_id",
    "person_id",
    "secret",
    "code_hash",
    "record",  # of an inspection: it names others, and the person's entries are listed
}
_COLUMNS: Final = ("climbed_at", "gym_name", "route_name", "grade", "kind", "tries", "note")


def all_of(session: Session, person: UUID) -> dict[str, Any]:
    """Return the account and all of its rows, without hashes of secrets."""
    data: dict[str, Any] = {"account": _row_columns(session.get_one(Person, person))}
    for name, kind in {**_KINDS, **dict(collect_answers(session, OwnTables()))}.items():
        mine: Select[Any] = select(kind).where(kind.person_id == person)
        data[name] = [_row_columns(row) for row in session.scalars(mine)]
    data["following"] = [vars(known) for known in following(session, person)]
    data["followers"] = [vars(known) for known in followers(session, person)]
    return data


def _row_columns(row: Any) -> dict[str, Any]:
    names = [column.key for column in inspect(type(row)).column_attrs]
    return {name: getattr(row, name) for name in names if name not in _LEFT_OUT}


def ascents_csv(session: Session, person: UUID, dialect: CsvDialect) -> str:
    """Return one's ascents as CSV, the earliest first."""
    mine = select(Ascent).where(Ascent.person_id == person, Ascent.taken_back_at.is_(None))
    rows = session.scalars(mine.order_by(Ascent.climbed_at, Ascent.id))
    return csv_table(
        _COLUMNS,
        (
            {name: getattr(row, name) for name in _COLUMNS}
            | {"climbed_at": row.climbed_at.isoformat()}
            for row in rows
        ),
        dialect,
    )


def delete_account(session: Session, person: UUID, *, by: UUID | None = None) -> None:
    """Delete an account with all of its data; the audit log keeps its meaningless id.

    Parameters
    ----------
    by : the person, or the operator who does it; None: by command.

    Raises
    ------
    ConflictError : a gym would be left without an owner.
    """
    for gym in _owned_gyms(session, person):
        owners = select(func.count()).where(
            Membership.gym_id == gym.id, Membership.role == Role.OWNER
        )
        if (session.scalar(owners) or 0) <= 1:
            raise ConflictError("gym-without-owner", "gym-owner-first", gym=gym.name)
    publish_event(session, PersonDeleted(person))
    email = session.get_one(Person, person).email
    session.execute(delete(MailedLink).where(MailedLink.email == email))
    session.execute(delete(Person).where(Person.id == person))
    log_change(session, "person.delete", person=by, subject=str(person))


def _owned_gyms(session: Session, person: UUID) -> Sequence[Gym]:
    """Return the gyms that a person owns, locked so that two owners cannot leave at once."""
    mine = select(Membership.gym_id).where(
        Membership.person_id == person, Membership.role == Role.OWNER
    )
    return session.scalars(select(Gym).where(Gym.id.in_(mine)).with_for_update()).all()

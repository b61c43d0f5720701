"""The log of who changed what; written in the transaction of the change itself."""

from __future__ import annotations

from uuid import UUID

from sqlalchemy.orm import Session

from walltopo_gym.accounts.models import AuditEntry


def log_change(
    session: Session,
    action: str,
    *,
    person: UUID | None,
    gym: UUID | None = None,
    subject: str = "",
    **details: str | int | bool | None,
) -> None:
    """Note a change.

    Parameters
    ----------
    action : what was done, such as "wall.create".
    subject : of what, in words or by its id; details : anything that is no secret.
    """
    entry = AuditEntry(
        person_id=person, gym_id=gym, action=action, subject=subject[:200], details=details
    )
    session.add(entry)

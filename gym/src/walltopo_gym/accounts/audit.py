"""The audit log: who changed what. Entries are written in the transaction of the change."""

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
    """Log a change.

    Parameters
    ----------
    action : the kind of change, such as "wall.create".
    subject : the changed thing, by name or id; details : any facts that are not secret.
    """
    entry = AuditEntry(
        person_id=person, gym_id=gym, action=action, subject=subject[:200], details=details
    )
    session.add(entry)

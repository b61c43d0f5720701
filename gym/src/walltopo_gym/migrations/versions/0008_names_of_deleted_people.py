"""Names and texts of people that earlier versions kept where deleting an account did not reach."""

from __future__ import annotations

from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None

_AUDIT = sa.table(
    "audit",
    *(
        sa.column(name, kind)
        for name, kind in (
            ("id", sa.Uuid()),
            ("action", sa.String()),
            ("subject", sa.String()),
            ("details", sa.JSON()),
        )
    ),
)
_PLACEMENTS = sa.table(
    "placements",
    *(
        sa.column(name, kind)
        for name, kind in (
            ("scan_id", sa.Uuid()),
            ("number", sa.Integer()),
            ("route_id", sa.Uuid()),
            ("as_was", sa.JSON(none_as_null=True)),
        )
    ),
)
_MESSAGES = sa.table("messages", sa.column("sent_at"), sa.column("body", sa.JSON()))


def upgrade() -> None:
    """Remove them."""
    connection = op.get_bind()
    _shorten_log(connection)
    _unname_promoted(connection)
    connection.execute(sa.update(_MESSAGES).where(_MESSAGES.c.sent_at.is_not(None)).values(body={}))
    for statement in (
        "UPDATE hold_reports SET note = '' WHERE person_id IS NULL",
        "UPDATE score_events SET text = '' WHERE person_id IS NULL AND kind = 'appeal'",
        "UPDATE competition_waivers SET signed_by = '—' WHERE entry_id IN"
        " (SELECT id FROM competition_entries WHERE name = '—')",
    ):
        connection.execute(sa.text(statement))


def _shorten_log(connection: Any) -> None:
    named = sa.or_(
        _AUDIT.c.action.like("entry.%"),
        _AUDIT.c.action.like("problem.%"),
        _AUDIT.c.action == "member.ban",
    )
    rows = connection.execute(sa.select(_AUDIT).where(named)).all()
    for row in rows:
        known = row.details if isinstance(row.details, dict) else {}
        details = {key: value for key, value in known.items() if key != "reason"}
        subject = details.get("entry") or details.get("problem") or row.subject
        change = sa.update(_AUDIT).where(_AUDIT.c.id == row.id)
        connection.execute(change.values(subject=subject, details=details))


def _unname_promoted(connection: Any) -> None:
    """Blank the setter of routes that were made of problems, where it is the author's name."""
    promoted = connection.execute(
        sa.text(
            "SELECT routes.id, routes.setter FROM routes JOIN problems ON problems.route_id = routes.id"
            " JOIN people ON people.id = problems.person_id AND people.name = routes.setter"
        ).columns(id=sa.Uuid(), setter=sa.String())
    ).all()
    for route, setter in promoted:
        for text in (
            "UPDATE walls SET revision = revision + 1 WHERE id IN"
            " (SELECT wall_id FROM routes WHERE id = :id)",
            "UPDATE routes SET setter = '' WHERE id = :id",
        ):
            key = sa.bindparam("id", route, sa.Uuid())
            connection.execute(sa.text(text).bindparams(key))
        of = _PLACEMENTS.c.route_id == route
        for row in connection.execute(sa.select(_PLACEMENTS).where(of)).all():
            if row.as_was and row.as_was.get("setter") == setter:
                here = sa.and_(
                    _PLACEMENTS.c.scan_id == row.scan_id, _PLACEMENTS.c.number == row.number
                )
                change = sa.update(_PLACEMENTS).where(here)
                connection.execute(change.values(as_was=row.as_was | {"setter": ""}))

"""The style of a placed route, and notes on ascents."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None

_PLANS = sa.table("plans", sa.column("scan_id", sa.Uuid()), sa.column("holds", sa.JSON()),
                  sa.column("found", sa.JSON()))  # fmt: skip


def upgrade() -> None:
    """Go to this version."""
    with op.batch_alter_table("placements", schema=None) as batch_op:
        batch_op.add_column(sa.Column("steepness_deg", sa.Double(), nullable=True))
        batch_op.add_column(
            sa.Column("hold_types", sa.JSON(), nullable=False, server_default=sa.text("'{}'"))
        )
    with op.batch_alter_table("placements", schema=None) as batch_op:
        batch_op.alter_column("hold_types", server_default=None)
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("note", sa.String(length=500), nullable=False, server_default="")
        )
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.alter_column("note", server_default=None)
    with op.batch_alter_table("plans", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("found", sa.JSON(), nullable=False, server_default=sa.text("'{}'"))
        )
    _rewrite("holds", "found", lambda kept: {n: {"holds": held} for n, held in kept.items()})
    with op.batch_alter_table("plans", schema=None) as batch_op:
        batch_op.alter_column("found", server_default=None)
        batch_op.drop_column("holds")


def _rewrite(old: str, new: str, change: Callable[[dict[str, Any]], dict[str, Any]]) -> None:
    """Plans that wait, in the other column's form."""
    bind = op.get_bind()
    for scan, kept in bind.execute(sa.select(_PLANS.c.scan_id, _PLANS.c[old])).all():
        row = sa.update(_PLANS).where(_PLANS.c.scan_id == scan)
        bind.execute(row.values({new: change(kept)}))


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("plans", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("holds", sa.JSON(), nullable=False, server_default=sa.text("'{}'"))
        )
    _rewrite("found", "holds", lambda kept: {n: row["holds"] for n, row in kept.items()})
    with op.batch_alter_table("plans", schema=None) as batch_op:
        batch_op.alter_column("holds", server_default=None)
        batch_op.drop_column("found")
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.drop_column("note")
    with op.batch_alter_table("placements", schema=None) as batch_op:
        batch_op.drop_column("hold_types")
        batch_op.drop_column("steepness_deg")

"""Ascents and opinions remember their edits, so that a late copy of an older one changes nothing."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0019"
down_revision = "0018"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    for table in ("ascents", "opinions"):
        op.add_column(table, sa.Column("edited_at", UtcTime(), nullable=True))
        op.add_column(table, sa.Column("edited_by", sa.Uuid(), nullable=True))
        op.add_column(table, sa.Column("edits", sa.JSON(), nullable=False, server_default="{}"))


def downgrade() -> None:
    """Go back to the version before."""
    for table in ("ascents", "opinions"):
        for column in ("edits", "edited_by", "edited_at"):
            op.drop_column(table, column)

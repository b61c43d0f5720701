"""The channel of the week's summary."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0015"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; those who have the summary go on to get it by mail."""
    op.add_column(
        "notification_preferences",
        sa.Column("digest_by", sa.String(length=4), server_default="mail", nullable=False),
    )

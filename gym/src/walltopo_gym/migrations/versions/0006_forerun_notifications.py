"""Notifications for forerunners."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0005"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column(
        "notification_preferences",
        sa.Column("forerun", sa.Boolean(), server_default=sa.text("false"), nullable=False),
    )

"""Delivered messages to webhooks stay for some days, so that they can be sent again."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0033"
down_revision = "0032"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("webhook_events", sa.Column("delivered_at", UtcTime(), nullable=True))

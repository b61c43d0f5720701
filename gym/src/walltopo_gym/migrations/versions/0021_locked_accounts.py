"""Locked accounts."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column; no account is locked."""
    op.add_column("people", sa.Column("locked_at", UtcTime(), nullable=True))

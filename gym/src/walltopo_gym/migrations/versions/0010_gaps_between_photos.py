"""The photos between which another one would join two groups."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column(
        "photo_overlaps", sa.Column("gaps", sa.JSON(), server_default="[]", nullable=False)
    )

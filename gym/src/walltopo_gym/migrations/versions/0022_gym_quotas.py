"""Storage quotas of gyms, and features that an operator turned off for them."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0022"
down_revision = "0021"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; no gym has a quota, and all have all features."""
    op.add_column(
        "gyms", sa.Column("features_barred", sa.JSON(), server_default="[]", nullable=False)
    )
    op.add_column("gyms", sa.Column("storage_quota_mb", sa.Integer(), nullable=True))

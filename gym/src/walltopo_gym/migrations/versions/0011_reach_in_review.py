"""The heights that reach the top of a route in review."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    column = sa.Column("reach", sa.JSON(none_as_null=True), nullable=True)
    op.add_column("scan_places", column)

"""The colours whose holds a partial rescan exchanges."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0005"
down_revision = "0004"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("scans", sa.Column("colours", sa.JSON(), server_default="[]", nullable=False))

"""Units and paper of gyms."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0029"
down_revision = "0028"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; all gyms measure in metres and print on A4."""
    for name, length, usual in (("units", 8, "metric"), ("paper", 6, "a4")):
        op.add_column(
            "gyms",
            sa.Column(name, sa.String(length=length), server_default=usual, nullable=False),
        )

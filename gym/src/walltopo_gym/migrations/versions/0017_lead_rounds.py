"""High points on routes, and the number of a route's holds."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns; scores of boulders have none of them."""
    op.add_column("competition_problems", sa.Column("holds", sa.Integer(), nullable=True))
    op.add_column("score_events", sa.Column("hold", sa.Integer(), nullable=True))
    op.add_column(
        "score_events",
        sa.Column("plus", sa.Boolean(), server_default=sa.false(), nullable=False),
    )
    op.add_column("score_events", sa.Column("seconds", sa.Integer(), nullable=True))

"""When the owner of a sign-in last proved who they are."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the column."""
    op.add_column("sign_ins", sa.Column("confirmed_at", UtcTime(), nullable=True))

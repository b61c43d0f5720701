"""A gym's own network, and the network that found a scan's holds."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0004"
down_revision = "0003"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table and the column."""
    op.create_table(
        "own_networks",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("wanted", sa.Boolean(), nullable=False),
        sa.Column("basis", sa.JSON(), nullable=False),
        sa.Column("trained_at", UtcTime(), nullable=True),
        sa.Column("result", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("key", sa.String(100), nullable=False),
        sa.Column("error", sa.String(500), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name=op.f("fk_own_networks_gym_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name=op.f("pk_own_networks")),
    )
    op.add_column("scans", sa.Column("network", sa.JSON(none_as_null=True), nullable=True))

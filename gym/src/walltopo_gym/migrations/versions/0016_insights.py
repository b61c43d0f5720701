"""What a gym wishes and has, and when walls were washed."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0016"
down_revision = "0014"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "gym_aims",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("wish", sa.JSON(), nullable=False),
        sa.Column("stock", sa.JSON(), nullable=False),
        sa.Column("wash_after", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name=op.f("fk_gym_aims_gym_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name=op.f("pk_gym_aims")),
    )
    op.create_table(
        "washings",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("washed_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name=op.f("fk_washings_wall_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_washings")),
    )
    op.create_index("ix_washings_last", "washings", ["wall_id", "washed_at"])


def downgrade() -> None:
    """Go back to the version before."""
    op.drop_index("ix_washings_last", table_name="washings")
    op.drop_table("washings")
    op.drop_table("gym_aims")

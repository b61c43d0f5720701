"""Floor plans; when a webhook was told last."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "floor_plans",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name=op.f("fk_floor_plans_gym_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name=op.f("pk_floor_plans")),
    )
    with op.batch_alter_table("walls", schema=None) as batch_op:
        batch_op.add_column(sa.Column("plan_x", sa.Double(), nullable=True))
        batch_op.add_column(sa.Column("plan_y", sa.Double(), nullable=True))
    with op.batch_alter_table("webhooks", schema=None) as batch_op:
        batch_op.add_column(sa.Column("told_at", UtcTime(), nullable=True))


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("webhooks", schema=None) as batch_op:
        batch_op.drop_column("told_at")
    with op.batch_alter_table("walls", schema=None) as batch_op:
        batch_op.drop_column("plan_y")
        batch_op.drop_column("plan_x")
    op.drop_table("floor_plans")

"""What background jobs have tried, what is being sent, whom a gym has withdrawn."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0021"
down_revision = "0020"
branch_labels = None
depends_on = None

_SENT = ("webhook_events", "messages")


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "job_attempts",
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("item", sa.Uuid(), nullable=False),
        sa.Column("version", sa.String(length=80), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("holder", sa.String(length=200), nullable=False),
        sa.Column("begun_at", UtcTime(), nullable=False),
        sa.Column("next_at", UtcTime(), nullable=True),
        sa.Column("error", sa.String(length=300), nullable=False),
        sa.PrimaryKeyConstraint("kind", "item", name=op.f("pk_job_attempts")),
    )
    for name in _SENT:
        with op.batch_alter_table(name, schema=None) as batch_op:
            batch_op.add_column(sa.Column("begun_at", UtcTime(), nullable=True))
    with op.batch_alter_table("competition_entries", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("removed", sa.Boolean(), nullable=False, server_default=sa.false())
        )


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("competition_entries", schema=None) as batch_op:
        batch_op.drop_column("removed")
    for name in _SENT:
        with op.batch_alter_table(name, schema=None) as batch_op:
            batch_op.drop_column("begun_at")
    op.drop_table("job_attempts")

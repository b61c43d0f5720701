"""Profiles, and pinned ascents."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0008"
down_revision = "0007"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "profiles",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("on_boards", sa.Boolean(), nullable=False),
        sa.Column("category", sa.String(length=10), nullable=False),
        sa.Column("birth_year", sa.Integer(), nullable=True),
        sa.Column("show_ascents", sa.String(length=10), nullable=False),
        sa.Column("show_pins", sa.String(length=10), nullable=False),
        sa.Column("show_body", sa.String(length=10), nullable=False),
        sa.Column("height_cm", sa.Integer(), nullable=True),
        sa.Column("reach_cm", sa.Integer(), nullable=True),
        sa.Column("changed_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name=op.f("fk_profiles_person_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("person_id", name=op.f("pk_profiles")),
    )
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.add_column(sa.Column("pinned_at", UtcTime(), nullable=True))


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.drop_column("pinned_at")
    op.drop_table("profiles")

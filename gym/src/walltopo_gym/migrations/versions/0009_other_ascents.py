"""Ascents outdoors, in other gyms and on boards."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0009"
down_revision = "0008"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table."""
    op.create_table(
        "other_ascents",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("venue", sa.String(10), nullable=False),
        sa.Column("discipline", sa.String(10), nullable=False),
        sa.Column("name", sa.String(120), nullable=False),
        sa.Column("location", sa.String(120), nullable=False),
        sa.Column("grade", sa.String(40), nullable=False),
        sa.Column("kind", sa.String(10), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("note", sa.String(4000), nullable=False),
        sa.Column("climbed_at", UtcTime(), nullable=False),
        sa.Column("source", sa.String(20), nullable=False),
        sa.Column("withdrawn_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name="fk_other_ascents_person_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_other_ascents"),
    )
    op.create_index("ix_other_ascents_of", "other_ascents", ["person_id", "climbed_at"])

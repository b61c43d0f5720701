"""Films of clips."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0024"
down_revision = "0023"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns and the table of reports."""
    op.add_column(
        "clips", sa.Column("wants_film", sa.Boolean(), server_default=sa.false(), nullable=False)
    )
    op.add_column("clips", sa.Column("film_size", sa.BigInteger(), nullable=True))
    op.add_column("clips", sa.Column("published_at", UtcTime(), nullable=True))
    op.create_table(
        "film_reports",
        sa.Column("clip_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["clip_id"], ["clips.id"], name="fk_film_reports_clip_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_film_reports_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_film_reports"),
        sa.UniqueConstraint("clip_id", "person_id", name="uq_film_reports_clip_id_person_id"),
    )
    op.create_index("ix_film_reports_person_id", "film_reports", ["person_id"])

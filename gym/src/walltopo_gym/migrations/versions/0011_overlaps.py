"""Videos, and which photos overlap."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0010"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "photo_overlaps",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("asked", sa.Integer(), nullable=False),
        sa.Column("answered", sa.Integer(), nullable=False),
        sa.Column("groups", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name=op.f("fk_photo_overlaps_scan_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name=op.f("pk_photo_overlaps")),
    )
    with op.batch_alter_table("photos", schema=None) as batch_op:
        batch_op.add_column(sa.Column("frames", sa.Integer(), nullable=False, server_default="1"))


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("photos", schema=None) as batch_op:
        batch_op.drop_column("frames")
    op.drop_table("photo_overlaps")

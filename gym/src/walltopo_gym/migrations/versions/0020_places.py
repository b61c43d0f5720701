"""Where the grade model puts the routes of a scan."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0020"
down_revision = "0019"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "scan_places",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("model", sa.String(length=16), nullable=False),
        sa.Column("shown", sa.Integer(), nullable=False),
        sa.Column("learnt", sa.JSON(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name=op.f("fk_scan_places_scan_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name=op.f("pk_scan_places")),
    )
    op.create_table(
        "placed_routes",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("place", sa.Double(), nullable=False),
        sa.Column("known", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scan_places.scan_id"], name=op.f("fk_placed_routes_scan_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("scan_id", "number", name=op.f("pk_placed_routes")),
    )  # fmt: skip


def downgrade() -> None:
    """Go back to the version before."""
    op.drop_table("placed_routes")
    op.drop_table("scan_places")

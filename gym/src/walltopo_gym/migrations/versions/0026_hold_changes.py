"""Comparisons of versions, and the holds that changed."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0026"
down_revision = "0025"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables."""
    op.create_table(
        "hold_comparisons",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("since_id", sa.Uuid(), nullable=True),
        sa.Column("since", UtcTime(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.Column("compared", sa.Integer(), nullable=True),
        sa.Column("error", sa.String(length=500), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"],
            ["scans.id"],
            name="fk_hold_comparisons_scan_id_scans",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["since_id"],
            ["scans.id"],
            name="fk_hold_comparisons_since_id_scans",
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_hold_comparisons"),
    )
    op.create_index("ix_hold_comparisons_since_id", "hold_comparisons", ["since_id"])
    op.create_table(
        "hold_changes",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("hold", sa.Integer(), nullable=True),
        sa.Column("route_id", sa.Uuid(), nullable=True),
        sa.Column("colour", sa.String(length=40), nullable=False),
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("turn_deg", sa.Double(), nullable=True),
        sa.Column("moved_m", sa.Double(), nullable=True),
        sa.Column("done_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"],
            ["hold_comparisons.scan_id"],
            name="fk_hold_changes_scan_id_hold_comparisons",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["route_id"],
            ["routes.id"],
            name="fk_hold_changes_route_id_routes",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_hold_changes"),
    )
    op.create_index("ix_hold_changes_scan_id", "hold_changes", ["scan_id"])
    op.create_index("ix_hold_changes_route_id", "hold_changes", ["route_id"])

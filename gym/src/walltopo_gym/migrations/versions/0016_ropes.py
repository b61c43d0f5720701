"""Ropes: lines of walls, and disciplines of ascents and boards."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0016"
down_revision = "0015"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table and the columns; all climbs so far are boulders."""
    op.create_table(
        "rope_lines",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("label", sa.String(length=20), nullable=False),
        sa.Column("belays", sa.JSON(), nullable=False),
        sa.Column("points", sa.JSON(), nullable=False),
        sa.Column("removed_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_rope_lines_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_rope_lines"),
    )
    op.create_index("ix_rope_lines_wall_id", "rope_lines", ["wall_id"])
    with op.batch_alter_table("routes") as batch_op:
        batch_op.add_column(sa.Column("line_id", sa.Uuid(), nullable=True))
        batch_op.create_foreign_key(
            "fk_routes_line_id", "rope_lines", ["line_id"], ["id"], ondelete="SET NULL"
        )
        batch_op.create_index("ix_routes_line_id", ["line_id"])
    op.add_column(
        "ascents",
        sa.Column("discipline", sa.String(length=10), server_default="boulder", nullable=False),
    )
    op.add_column("ascents", sa.Column("high_point", sa.Integer(), nullable=True))
    _tell_boards_apart()


def _tell_boards_apart() -> None:
    """Add the discipline to the key of the standings."""
    op.drop_index("ix_standings_order", "standings")
    with op.batch_alter_table("standings") as batch_op:
        batch_op.add_column(
            sa.Column("discipline", sa.String(length=10), server_default="boulder", nullable=False)
        )
        batch_op.drop_constraint("pk_standings", type_="primary")
        batch_op.create_primary_key(
            "pk_standings", ["gym_id", "period", "discipline", "circuit", "person_id"]
        )
    order = ["gym_id", "period", "discipline", "circuit", "points"]
    op.create_index("ix_standings_order", "standings", order)

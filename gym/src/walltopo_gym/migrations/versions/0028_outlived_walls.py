"""Inspections that outlive their walls."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0028"
down_revision = "0027"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Copy names and places of walls, and let no mark go with its wall or version."""
    with op.batch_alter_table("inspected_walls") as batch_op:
        batch_op.add_column(
            sa.Column("name", sa.String(length=80), server_default="", nullable=False)
        )
        batch_op.add_column(sa.Column("place", sa.Integer(), server_default="0", nullable=False))
        batch_op.drop_constraint("fk_inspected_walls_wall_id", type_="foreignkey")
        batch_op.drop_constraint("fk_inspected_walls_scan_id", type_="foreignkey")
        batch_op.drop_index("ix_inspected_walls_scan_id")
    for column in ("name", "place"):
        op.execute(
            f"UPDATE inspected_walls SET {column} ="
            f" (SELECT walls.{column} FROM walls WHERE walls.id = inspected_walls.wall_id)"
        )
    with op.batch_alter_table("inspected_walls") as batch_op:
        batch_op.alter_column("name", server_default=None)
        batch_op.alter_column("place", server_default=None)
    with op.batch_alter_table("inspection_entries") as batch_op:
        batch_op.drop_constraint("fk_inspection_entries_wall_id", type_="foreignkey")
        batch_op.drop_constraint("fk_inspection_entries_scan_id", type_="foreignkey")
        batch_op.drop_index("ix_inspection_entries_wall_id")

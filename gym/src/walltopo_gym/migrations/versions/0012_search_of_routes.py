"""The height, the longest reach and the features of a route, by which climbers search."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the columns, and have the worker compute them for the published versions."""
    for name in ("longest_reach", "features"):
        column = sa.Column(name, sa.JSON(none_as_null=True), nullable=True)
        op.add_column("placements", column)
    op.add_column("placements", sa.Column("height_m", sa.Double(), nullable=True))
    scans, walls = (
        sa.table(name, *(sa.column(column) for column in columns))
        for name, columns in (("scans", ("id", "moves")), ("walls", ("published_scan_id",)))
    )
    published = sa.select(walls.c.published_scan_id)
    op.execute(scans.update().where(scans.c.id.in_(published)).values(moves=sa.null()))

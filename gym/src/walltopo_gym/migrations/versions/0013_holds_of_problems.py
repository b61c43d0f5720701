"""The holds of problems, one row each: problems are found by a hold."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0013"
down_revision = "0012"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the table, and fill it from the problems."""
    table = op.create_table(
        "problem_holds",
        sa.Column("problem_id", sa.Uuid(), nullable=False),
        sa.Column("hold", sa.Integer(), nullable=False),
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.ForeignKeyConstraint(
            ["problem_id"],
            ["problems.id"],
            name="fk_problem_holds_problem_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_problem_holds_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("problem_id", "hold", name="pk_problem_holds"),
    )
    op.create_index("ix_problem_holds_of_hold", "problem_holds", ["scan_id", "hold"])
    columns = (("id", sa.Uuid()), ("scan_id", sa.Uuid()), ("holds", sa.JSON()))
    problems = sa.table("problems", *(sa.column(name, kind) for name, kind in columns))
    for problem, scan, holds in op.get_bind().execute(sa.select(problems)).all():
        rows = [{"problem_id": problem, "hold": used["hold"], "scan_id": scan} for used in holds]
        if rows:
            op.bulk_insert(table, rows)

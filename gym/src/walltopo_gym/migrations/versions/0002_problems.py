"""Problems that climbers make."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0002"
down_revision = "0001"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "problems",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("grade_system_id", sa.Uuid(), nullable=True),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("share", sa.String(length=10), nullable=False),
        sa.Column("matching", sa.Boolean(), nullable=False),
        sa.Column("note", sa.String(length=300), nullable=False),
        sa.Column("holds", sa.JSON(), nullable=False),
        sa.Column("remix_of", sa.Uuid(), nullable=True),
        sa.Column("route_id", sa.Uuid(), nullable=True),
        sa.Column("hidden_at", UtcTime(), nullable=True),
        sa.Column("taken_back_at", UtcTime(), nullable=True),
        sa.Column("edited_at", UtcTime(), nullable=True),
        sa.Column("edited_by", sa.Uuid(), nullable=True),
        sa.Column("edits", sa.JSON(), server_default="{}", nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["grade_system_id"],
            ["grade_systems.id"],
            name="fk_problems_grade_system_id",
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_problems_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_problems_route_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_problems_scan_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_problems_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_problems"),
    )
    op.create_index("ix_problems_grade_system_id", "problems", ["grade_system_id"])
    op.create_index("ix_problems_of_person", "problems", ["person_id", "wall_id", "created_at"])
    op.create_index("ix_problems_of_wall", "problems", ["wall_id", "created_at", "id"])
    op.create_index("ix_problems_route_id", "problems", ["route_id"])
    op.create_index("ix_problems_scan_id", "problems", ["scan_id"])

    op.create_table(
        "problem_ascents",
        sa.Column("problem_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("climbed_at", UtcTime(), nullable=True),
        sa.Column("edited_at", UtcTime(), nullable=True),
        sa.Column("edited_by", sa.Uuid(), nullable=True),
        sa.Column("edits", sa.JSON(), server_default="{}", nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_problem_ascents_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["problem_id"],
            ["problems.id"],
            name="fk_problem_ascents_problem_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("problem_id", "person_id", name="pk_problem_ascents"),
    )
    op.create_index("ix_problem_ascents_person_id", "problem_ascents", ["person_id"])

    op.create_table(
        "problem_reports",
        sa.Column("problem_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("text", sa.String(length=400), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_problem_reports_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["problem_id"],
            ["problems.id"],
            name="fk_problem_reports_problem_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_problem_reports"),
        sa.UniqueConstraint(
            "problem_id", "person_id", name="uq_problem_reports_problem_id_person_id"
        ),
    )
    op.create_index("ix_problem_reports_person_id", "problem_reports", ["person_id"])

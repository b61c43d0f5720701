"""Inspections."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0027"
down_revision = "0026"
branch_labels = None
depends_on = None


def _key_to(table: str, column: str, target: str, gone: str) -> sa.ForeignKeyConstraint:
    name = f"fk_{table}_{column}"
    return sa.ForeignKeyConstraint([column], [f"{target}.id"], name=name, ondelete=gone)


def upgrade() -> None:
    """Add the tables and the preference."""
    _add_plans_and_keys()
    _add_inspections()
    _add_entries()
    op.add_column(
        "notification_preferences",
        sa.Column("inspections", sa.Boolean(), server_default=sa.text("false"), nullable=False),
    )


def _add_plans_and_keys() -> None:
    op.create_table(
        "inspection_plans",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("levels", sa.JSON(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to("inspection_plans", "gym_id", "gyms", "CASCADE"),
        sa.PrimaryKeyConstraint("gym_id", name="pk_inspection_plans"),
    )
    op.create_table(
        "inspection_keys",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("secret", sa.String(length=44), nullable=False),
        sa.Column("public_key", sa.String(length=44), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to("inspection_keys", "person_id", "people", "CASCADE"),
        sa.PrimaryKeyConstraint("person_id", name="pk_inspection_keys"),
    )


def _add_inspections() -> None:
    op.create_table(
        "inspections",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("level", sa.String(length=12), nullable=False),
        sa.Column("checklist", sa.JSON(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("corrects_id", sa.Uuid(), nullable=True),
        sa.Column("finished_at", UtcTime(), nullable=True),
        sa.Column("finished_by", sa.Uuid(), nullable=True),
        sa.Column("result", sa.String(length=10), nullable=False),
        sa.Column("remarks", sa.String(length=2000), nullable=False),
        sa.Column("record", sa.Text(), nullable=False),
        sa.Column("public_key", sa.String(length=44), nullable=False),
        sa.Column("signature", sa.String(length=88), nullable=False),
        sa.Column("code", sa.String(length=16), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to("inspections", "gym_id", "gyms", "CASCADE"),
        _key_to("inspections", "person_id", "people", "SET NULL"),
        _key_to("inspections", "finished_by", "people", "SET NULL"),
        _key_to("inspections", "corrects_id", "inspections", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_inspections"),
    )
    op.create_index("ix_inspections_of_gym", "inspections", ["gym_id", "created_at"])
    op.create_index("ix_inspections_code", "inspections", ["code"], unique=True)
    for column in ("person_id", "corrects_id", "finished_at", "finished_by"):
        op.create_index(f"ix_inspections_{column}", "inspections", [column])
    op.create_table(
        "inspected_walls",
        sa.Column("inspection_id", sa.Uuid(), nullable=False),
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("scan_id", sa.Uuid(), nullable=True),
        _key_to("inspected_walls", "inspection_id", "inspections", "CASCADE"),
        _key_to("inspected_walls", "wall_id", "walls", "CASCADE"),
        _key_to("inspected_walls", "scan_id", "scans", "SET NULL"),
        sa.PrimaryKeyConstraint("inspection_id", "wall_id", name="pk_inspected_walls"),
    )
    for column in ("wall_id", "scan_id"):
        op.create_index(f"ix_inspected_walls_{column}", "inspected_walls", [column])


def _add_entries() -> None:
    table = "inspection_entries"
    op.create_table(
        table,
        sa.Column("inspection_id", sa.Uuid(), nullable=False),
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("scan_id", sa.Uuid(), nullable=True),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("item", sa.Integer(), nullable=True),
        sa.Column("hold", sa.Integer(), nullable=True),
        sa.Column("mark", sa.String(length=10), nullable=False),
        sa.Column("note", sa.String(length=300), nullable=False),
        sa.Column("photo", sa.String(length=64), nullable=True),
        sa.Column("made_at", UtcTime(), nullable=False),
        sa.Column("device", sa.Uuid(), nullable=True),
        sa.Column("number", sa.BigInteger(), nullable=True),
        sa.Column("late", sa.Boolean(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to(table, "inspection_id", "inspections", "CASCADE"),
        _key_to(table, "wall_id", "walls", "CASCADE"),
        _key_to(table, "scan_id", "scans", "CASCADE"),
        _key_to(table, "person_id", "people", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name="pk_inspection_entries"),
    )
    op.create_index("ix_inspection_entries_of_inspection", table, ["inspection_id", "made_at"])
    op.create_index("ix_inspection_entries_of_hold", table, ["scan_id", "hold"])
    for column in ("wall_id", "person_id"):
        op.create_index(f"ix_inspection_entries_{column}", table, [column])

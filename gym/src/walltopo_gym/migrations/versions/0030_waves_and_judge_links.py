"""Limits of attempts, waves and planned starts of competitions; judges' links."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0030"
down_revision = "0029"
branch_labels = None
depends_on = None


def _key_to(table: str, column: str, target: str, gone: str) -> sa.ForeignKeyConstraint:
    name = f"fk_{table}_{column}"
    return sa.ForeignKeyConstraint([column], [f"{target}.id"], name=name, ondelete=gone)


def upgrade() -> None:
    """Add the columns and tables."""
    for column in ("max_attempts", "isolation_minutes", "rotation_seconds"):
        op.add_column("competition_rounds", sa.Column(column, sa.Integer(), nullable=True))
    _add_waves()
    _add_links()


def _add_waves() -> None:
    table = "competition_waves"
    op.create_table(
        table,
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("round_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("starts_at", UtcTime(), nullable=False),
        sa.Column("ends_at", UtcTime(), nullable=False),
        sa.Column("places", sa.Integer(), nullable=True),
        _key_to(table, "round_id", "competition_rounds", "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=f"pk_{table}"),
    )
    op.create_index(f"ix_{table}_round_id", table, ["round_id"])
    _add_reference("competition_entries", "wave_id", table)


def _add_links() -> None:
    links, judges = "competition_judge_links", "competition_link_judges"
    op.create_table(
        links,
        sa.Column("problem_id", sa.Uuid(), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("revoked_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to(links, "problem_id", "competition_problems", "CASCADE"),
        _key_to(links, "person_id", "people", "SET NULL"),
        sa.PrimaryKeyConstraint("id", name=f"pk_{links}"),
        sa.UniqueConstraint("token_hash", name=f"uq_{links}_token_hash"),
    )
    for column in ("problem_id", "person_id"):
        op.create_index(f"ix_{links}_{column}", links, [column])
    op.create_table(
        judges,
        sa.Column("link_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("used_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _key_to(judges, "link_id", links, "CASCADE"),
        sa.PrimaryKeyConstraint("id", name=f"pk_{judges}"),
        sa.UniqueConstraint("token_hash", name=f"uq_{judges}_token_hash"),
    )
    op.create_index(f"ix_{judges}_link_id", judges, ["link_id"])
    _add_reference("score_events", "link_judge_id", judges)


def _add_reference(table: str, column: str, target: str) -> None:
    """Add a column that refers to a row, which may be deleted."""
    with op.batch_alter_table(table) as changed:
        changed.add_column(sa.Column(column, sa.Uuid(), nullable=True))
        changed.create_foreign_key(
            f"fk_{table}_{column}", target, [column], ["id"], ondelete="SET NULL"
        )
        changed.create_index(f"ix_{table}_{column}", [column])

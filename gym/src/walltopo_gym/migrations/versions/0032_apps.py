"""Apps of others: registrations, connections, grants and their tokens."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0032"
down_revision = "0031"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Add the tables, and the grant of a token."""
    _add_apps()
    _add_connections()
    _add_grants()
    with op.batch_alter_table("api_tokens") as changed:
        changed.add_column(sa.Column("grant_id", sa.Uuid(), nullable=True))
        changed.create_foreign_key(
            "fk_api_tokens_grant_id", "app_grants", ["grant_id"], ["id"], ondelete="CASCADE"
        )
        changed.create_index("ix_api_tokens_grant_id", ["grant_id"])


def _key_to(table: str, column: str, target: str) -> sa.ForeignKeyConstraint:
    name = f"fk_{table}_{column}"
    return sa.ForeignKeyConstraint([column], [f"{target}.id"], name=name, ondelete="CASCADE")


def _add_table(table: str, *parts: sa.schema.SchemaItem) -> None:
    op.create_table(
        table,
        *parts,
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name=f"pk_{table}"),
    )


def _add_apps() -> None:
    _add_table(
        "apps",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("home_page", sa.String(length=500), nullable=False),
        sa.Column("redirects", sa.JSON(), nullable=False),
        sa.Column("password_hash", sa.String(length=64), nullable=True),
        _key_to("apps", "person_id", "people"),
    )
    op.create_index("ix_apps_person_id", "apps", ["person_id"])


def _add_connections() -> None:
    table = "app_connections"
    _add_table(
        table,
        sa.Column("app_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("used_at", UtcTime(), nullable=True),
        _key_to(table, "app_id", "apps"),
        _key_to(table, "person_id", "people"),
        sa.UniqueConstraint("app_id", "person_id", name=f"uq_{table}_app_id_person_id"),
    )
    op.create_index(f"ix_{table}_person_id", table, ["person_id"])


def _add_grants() -> None:
    grants, tokens = "app_grants", "app_refresh_tokens"
    _add_table(
        grants,
        sa.Column("connection_id", sa.Uuid(), nullable=False),
        sa.Column("code_hash", sa.String(length=64), nullable=False),
        sa.Column("challenge", sa.String(length=43), nullable=False),
        sa.Column("redirect", sa.String(length=500), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("used_at", UtcTime(), nullable=True),
        sa.Column("expires_at", UtcTime(), nullable=False),
        _key_to(grants, "connection_id", "app_connections"),
        sa.UniqueConstraint("code_hash", name=f"uq_{grants}_code_hash"),
    )
    op.create_index(f"ix_{grants}_connection_id", grants, ["connection_id"])
    _add_table(
        tokens,
        sa.Column("grant_id", sa.Uuid(), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("used_at", UtcTime(), nullable=True),
        _key_to(tokens, "grant_id", grants),
        sa.UniqueConstraint("token_hash", name=f"uq_{tokens}_token_hash"),
    )
    op.create_index(f"ix_{tokens}_grant_id", tokens, ["grant_id"])

"""The screen in the hall; what people want to be told, and what they were."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0017"
down_revision = "0016"
branch_labels = None
depends_on = None


def _belongs(table: str, column: str, other: str) -> sa.ForeignKeyConstraint:
    name = op.f(f"fk_{table}_{column}")
    return sa.ForeignKeyConstraint([column], [f"{other}.id"], name=name, ondelete="CASCADE")


def upgrade() -> None:
    """Go to this version."""
    with op.batch_alter_table("profiles", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("on_screens", sa.Boolean(), server_default=sa.false(), nullable=False)
        )
    op.create_table(
        "hall_settings",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("parts", sa.JSON(), nullable=False),
        sa.Column("seconds", sa.Integer(), nullable=False),
        sa.Column("days", sa.Integer(), nullable=False),
        sa.Column("board", sa.Boolean(), nullable=False),
        sa.Column("key_hash", sa.String(length=64), nullable=True),
        sa.Column("key_made_at", UtcTime(), nullable=True),
        _belongs("hall_settings", "gym_id", "gyms"),
        sa.PrimaryKeyConstraint("gym_id", name=op.f("pk_hall_settings")),
        sa.UniqueConstraint("key_hash", name=op.f("uq_hall_settings_key_hash")),
    )
    op.create_table(
        "wishes",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("language", sa.String(length=2), nullable=False),
        sa.Column("digest", sa.Boolean(), nullable=False),
        sa.Column("fresh", sa.Boolean(), nullable=False),
        sa.Column("soon", sa.Boolean(), nullable=False),
        sa.Column("competitions", sa.Boolean(), nullable=False),
        sa.Column("quiet_from", sa.Integer(), nullable=False),
        sa.Column("quiet_to", sa.Integer(), nullable=False),
        _belongs("wishes", "person_id", "people"),
        sa.PrimaryKeyConstraint("person_id", name=op.f("pk_wishes")),
    )
    op.create_table(
        "push_addresses",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("endpoint", sa.String(length=1000), nullable=False),
        sa.Column("public_key", sa.String(length=100), nullable=False),
        sa.Column("secret", sa.String(length=40), nullable=False),
        sa.Column("browser", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _belongs("push_addresses", "person_id", "people"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_push_addresses")),
        sa.UniqueConstraint("endpoint", name=op.f("uq_push_addresses_endpoint")),
    )
    op.create_index(op.f("ix_push_addresses_person_id"), "push_addresses", ["person_id"])
    op.create_table(
        "messages",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("subject", sa.String(length=80), nullable=False),
        sa.Column("target", sa.String(length=36), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.Column("next_at", UtcTime(), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("sent_at", UtcTime(), nullable=True),
        sa.Column("error", sa.String(length=300), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _belongs("messages", "person_id", "people"),
        _belongs("messages", "gym_id", "gyms"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_messages")),
        sa.UniqueConstraint(
            "person_id",
            "kind",
            "subject",
            "target",
            name=op.f("uq_messages_person_id_kind_subject_target"),
        ),
    )
    op.create_index("ix_messages_due", "messages", ["sent_at", "next_at"])
    op.create_index(op.f("ix_messages_gym_id"), "messages", ["gym_id"])
    op.create_table(
        "server_secrets",
        sa.Column("name", sa.String(length=40), nullable=False),
        sa.Column("content", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("name", name=op.f("pk_server_secrets")),
    )


def downgrade() -> None:
    """Go back to the version before."""
    for table in ("server_secrets", "messages", "push_addresses", "wishes", "hall_settings"):
        op.drop_table(table)
    with op.batch_alter_table("profiles", schema=None) as batch_op:
        batch_op.drop_column("on_screens")

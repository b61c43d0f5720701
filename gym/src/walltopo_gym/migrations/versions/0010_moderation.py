"""Bans, hidden and reported comments, sign-ins by QR code, routes as they were."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0010"
down_revision = "0009"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "bans",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _to("bans", "gym_id", "gyms"),
        _to("bans", "person_id", "people"),
        sa.PrimaryKeyConstraint("gym_id", "person_id", name=op.f("pk_bans")),
    )
    op.create_index(op.f("ix_bans_person_id"), "bans", ["person_id"])
    op.create_table(
        "hidden_comments",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _to("hidden_comments", "route_id", "routes"),
        _to("hidden_comments", "person_id", "people"),
        sa.PrimaryKeyConstraint("route_id", "person_id", name=op.f("pk_hidden_comments")),
    )
    op.create_index(op.f("ix_hidden_comments_person_id"), "hidden_comments", ["person_id"])
    op.create_table(
        "reports",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("author_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("comment", sa.String(length=500), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _to("reports", "route_id", "routes"),
        _to("reports", "author_id", "people"),
        _to("reports", "person_id", "people"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_reports")),
        sa.UniqueConstraint(
            "route_id",
            "author_id",
            "person_id",
            name=op.f("uq_reports_route_id_author_id_person_id"),
        ),
    )
    op.create_index(op.f("ix_reports_author_id"), "reports", ["author_id"])
    op.create_index(op.f("ix_reports_person_id"), "reports", ["person_id"])
    op.create_table(
        "handovers",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("sign_in_id", sa.Uuid(), nullable=False),
        sa.Column("offer_hash", sa.String(length=64), nullable=False),
        sa.Column("claim_hash", sa.String(length=64), nullable=True),
        sa.Column("browser", sa.String(length=200), nullable=False),
        sa.Column("code", sa.String(length=6), nullable=False),
        sa.Column("allowed", sa.Boolean(), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        _to("handovers", "person_id", "people"),
        _to("handovers", "sign_in_id", "sign_ins"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_handovers")),
        sa.UniqueConstraint("offer_hash", name=op.f("uq_handovers_offer_hash")),
        sa.UniqueConstraint("claim_hash", name=op.f("uq_handovers_claim_hash")),
    )
    op.create_index(op.f("ix_handovers_person_id"), "handovers", ["person_id"])
    op.create_index("ix_opinions_newest", "opinions", ["route_id", "changed_at"])
    with op.batch_alter_table("placements", schema=None) as batch_op:
        batch_op.add_column(sa.Column("as_was", sa.JSON(), nullable=True))


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("placements", schema=None) as batch_op:
        batch_op.drop_column("as_was")
    op.drop_index("ix_opinions_newest", "opinions")
    for table in ("handovers", "reports", "hidden_comments", "bans"):
        op.drop_table(table)


def _to(table: str, column: str, other: str) -> sa.ForeignKeyConstraint:
    return sa.ForeignKeyConstraint(
        [column], [f"{other}.id"], name=op.f(f"fk_{table}_{column}"), ondelete="CASCADE"
    )

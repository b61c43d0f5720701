"""Sessions, standings, who follows whom; what ascents are worth."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0012"
down_revision = "0011"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version. What is counted is counted by `migrations/run.py`."""
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.add_column(sa.Column("worth", sa.Integer(), nullable=True))
        batch_op.add_column(
            sa.Column("circuit", sa.String(length=80), nullable=False, server_default="")
        )
        batch_op.add_column(sa.Column("climbed_route", sa.Uuid(), nullable=True))
        batch_op.create_index(
            "ix_ascents_person_id_gym_id_climbed_at", ["person_id", "gym_id", "climbed_at"]
        )
    with op.batch_alter_table("gyms", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("boards", sa.String(length=10), nullable=False, server_default="one")
        )
    with op.batch_alter_table("profiles", schema=None) as batch_op:
        batch_op.add_column(
            sa.Column("feed", sa.Boolean(), nullable=False, server_default=sa.true())
        )
    _sessions()
    _standings()
    _follows()


def _sessions() -> None:
    op.create_table(
        "climbing_sessions",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("day", sa.Date(), nullable=False),
        sa.Column("began_at", UtcTime(), nullable=False),
        sa.Column("ended_at", UtcTime(), nullable=False),
        sa.Column("closed", sa.Boolean(), nullable=False),
        sa.Column("ascents", sa.Integer(), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("tops", sa.Integer(), nullable=False),
        sa.Column("flashes", sa.Integer(), nullable=False),
        sa.Column("points", sa.Integer(), nullable=False),
        sa.Column("hardest", sa.String(length=80), nullable=False),
        sa.Column("hardest_worth", sa.Integer(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        *_of("climbing_sessions"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_climbing_sessions")),
    )
    op.create_index(
        "ix_climbing_sessions_of", "climbing_sessions", ["person_id", "gym_id", "began_at"]
    )
    op.create_index("ix_climbing_sessions_feed", "climbing_sessions", ["gym_id", "began_at"])
    op.create_table(
        "session_marks",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("kind", sa.String(length=5), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        *_of("session_marks"),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_session_marks")),
    )
    op.create_index("ix_session_marks_of", "session_marks", ["person_id", "gym_id", "at"])
    op.create_index(op.f("ix_session_marks_gym_id"), "session_marks", ["gym_id"])


def _standings() -> None:
    op.create_table(
        "standings",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("period", sa.String(length=7), nullable=False),
        sa.Column("circuit", sa.String(length=80), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("points", sa.Integer(), nullable=False),
        sa.Column("tops", sa.Integer(), nullable=False),
        sa.Column("flashes", sa.Integer(), nullable=False),
        *_of("standings"),
        sa.PrimaryKeyConstraint(
            "gym_id", "period", "circuit", "person_id", name=op.f("pk_standings")
        ),
    )
    op.create_index("ix_standings_order", "standings", ["gym_id", "period", "circuit", "points"])
    op.create_index(op.f("ix_standings_person_id"), "standings", ["person_id"])


def _follows() -> None:
    op.create_table(
        "follows",
        sa.Column("follower_id", sa.Uuid(), nullable=False),
        sa.Column("followed_id", sa.Uuid(), nullable=False),
        sa.Column("accepted", sa.Boolean(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["follower_id"], ["people.id"], name=op.f("fk_follows_follower_id"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["followed_id"], ["people.id"], name=op.f("fk_follows_followed_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("follower_id", "followed_id", name=op.f("pk_follows")),
    )
    op.create_index(op.f("ix_follows_followed_id"), "follows", ["followed_id"])


def _of(table: str) -> tuple[sa.ForeignKeyConstraint, sa.ForeignKeyConstraint]:
    return (
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name=op.f(f"fk_{table}_person_id"), ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name=op.f(f"fk_{table}_gym_id"), ondelete="CASCADE"
        ),
    )


def downgrade() -> None:
    """Go back to the version before."""
    for table in ("follows", "standings", "session_marks", "climbing_sessions"):
        op.drop_table(table)
    with op.batch_alter_table("profiles", schema=None) as batch_op:
        batch_op.drop_column("feed")
    with op.batch_alter_table("gyms", schema=None) as batch_op:
        batch_op.drop_column("boards")
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.drop_index("ix_ascents_person_id_gym_id_climbed_at")
        batch_op.drop_column("climbed_route")
        batch_op.drop_column("circuit")
        batch_op.drop_column("worth")

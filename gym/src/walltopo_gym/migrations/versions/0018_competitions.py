"""Competitions."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0018"
down_revision = "0017"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    op.create_table(
        "competitions",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("format", sa.String(length=10), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("about", sa.String(length=2000), nullable=False),
        sa.Column("fee", sa.String(length=200), nullable=False),
        sa.Column("waiver", sa.Text(), nullable=False),
        sa.Column("starts_at", UtcTime(), nullable=True),
        sa.Column("ends_at", UtcTime(), nullable=True),
        sa.Column("self_entry", sa.Boolean(), nullable=False),
        sa.Column("self_scoring", sa.Boolean(), nullable=False),
        sa.Column("late_minutes", sa.Integer(), nullable=False),
        sa.Column("league_best", sa.Integer(), nullable=True),
        sa.Column("team_size", sa.Integer(), nullable=True),
        sa.Column("frozen_at", UtcTime(), nullable=True),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("last_seq", sa.Integer(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name=op.f("fk_competitions_gym_id"), ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competitions")),
    )
    op.create_index(op.f("ix_competitions_gym_id"), "competitions", ["gym_id"], unique=False)
    op.create_table(
        "competition_categories",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("competition_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("gender", sa.String(length=10), nullable=False),
        sa.Column("born_from", sa.Integer(), nullable=True),
        sa.Column("born_to", sa.Integer(), nullable=True),
        sa.ForeignKeyConstraint(
            ["competition_id"],
            ["competitions.id"],
            name=op.f("fk_competition_categories_competition_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competition_categories")),
    )
    op.create_index(
        op.f("ix_competition_categories_competition_id"),
        "competition_categories",
        ["competition_id"],
        unique=False,
    )
    op.create_table(
        "competition_rounds",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("competition_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("scoring", sa.JSON(), nullable=False),
        sa.Column("quota", sa.Integer(), nullable=True),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("opens_at", UtcTime(), nullable=True),
        sa.Column("closes_at", UtcTime(), nullable=True),
        sa.Column("begun_at", UtcTime(), nullable=True),
        sa.ForeignKeyConstraint(
            ["competition_id"],
            ["competitions.id"],
            name=op.f("fk_competition_rounds_competition_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competition_rounds")),
    )
    op.create_index(
        op.f("ix_competition_rounds_competition_id"),
        "competition_rounds",
        ["competition_id"],
        unique=False,
    )
    op.create_table(
        "competition_entries",
        sa.Column("competition_id", sa.Uuid(), nullable=False),
        sa.Column("category_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("bib", sa.Integer(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("team", sa.String(length=80), nullable=False),
        sa.Column("club", sa.String(length=80), nullable=False),
        sa.Column("birth_year", sa.Integer(), nullable=True),
        sa.Column("gender", sa.String(length=10), nullable=False),
        sa.Column("handicap", sa.Integer(), nullable=False),
        sa.Column("withdrawn", sa.Boolean(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["category_id"],
            ["competition_categories.id"],
            name=op.f("fk_competition_entries_category_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["competition_id"],
            ["competitions.id"],
            name=op.f("fk_competition_entries_competition_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name=op.f("fk_competition_entries_person_id"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competition_entries")),
        sa.UniqueConstraint(
            "competition_id", "bib", name=op.f("uq_competition_entries_competition_id_bib")
        ),
        sa.UniqueConstraint(
            "competition_id",
            "person_id",
            name=op.f("uq_competition_entries_competition_id_person_id"),
        ),
    )
    op.create_index(
        op.f("ix_competition_entries_category_id"),
        "competition_entries",
        ["category_id"],
        unique=False,
    )
    op.create_index(
        op.f("ix_competition_entries_person_id"), "competition_entries", ["person_id"], unique=False
    )
    op.create_table(
        "competition_problems",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("round_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("label", sa.String(length=20), nullable=False),
        sa.Column("route_id", sa.Uuid(), nullable=True),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("colour", sa.String(length=40), nullable=False),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("wall", sa.String(length=80), nullable=False),
        sa.Column("points", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("category_ids", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["round_id"],
            ["competition_rounds.id"],
            name=op.f("fk_competition_problems_round_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["route_id"],
            ["routes.id"],
            name=op.f("fk_competition_problems_route_id"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competition_problems")),
    )
    op.create_index(
        op.f("ix_competition_problems_round_id"), "competition_problems", ["round_id"], unique=False
    )
    op.create_index(
        op.f("ix_competition_problems_route_id"), "competition_problems", ["route_id"], unique=False
    )
    op.create_table(
        "competition_starters",
        sa.Column("round_id", sa.Uuid(), nullable=False),
        sa.Column("entry_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["entry_id"],
            ["competition_entries.id"],
            name=op.f("fk_competition_starters_entry_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["round_id"],
            ["competition_rounds.id"],
            name=op.f("fk_competition_starters_round_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("round_id", "entry_id", name=op.f("pk_competition_starters")),
    )
    op.create_index(
        op.f("ix_competition_starters_entry_id"), "competition_starters", ["entry_id"], unique=False
    )
    op.create_table(
        "competition_waivers",
        sa.Column("entry_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("on_paper", sa.Boolean(), nullable=False),
        sa.Column("signed_by", sa.String(length=80), nullable=False),
        sa.Column("text", sa.Text(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["entry_id"],
            ["competition_entries.id"],
            name=op.f("fk_competition_waivers_entry_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name=op.f("fk_competition_waivers_person_id"),
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_competition_waivers")),
    )
    op.create_index(
        op.f("ix_competition_waivers_entry_id"), "competition_waivers", ["entry_id"], unique=False
    )
    op.create_index(
        op.f("ix_competition_waivers_person_id"), "competition_waivers", ["person_id"], unique=False
    )
    op.create_table(
        "score_events",
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("competition_id", sa.Uuid(), nullable=False),
        sa.Column("seq", sa.Integer(), nullable=False),
        sa.Column("entry_id", sa.Uuid(), nullable=False),
        sa.Column("problem_id", sa.Uuid(), nullable=True),
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("n", sa.Integer(), nullable=True),
        sa.Column("target_id", sa.Uuid(), nullable=True),
        sa.Column("text", sa.String(length=500), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("device", sa.String(length=40), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("made_at", UtcTime(), nullable=False),
        sa.Column("climbed_at", UtcTime(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["competition_id"],
            ["competitions.id"],
            name=op.f("fk_score_events_competition_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["entry_id"],
            ["competition_entries.id"],
            name=op.f("fk_score_events_entry_id"),
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name=op.f("fk_score_events_person_id"),
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["problem_id"],
            ["competition_problems.id"],
            name=op.f("fk_score_events_problem_id"),
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name=op.f("pk_score_events")),
        sa.UniqueConstraint(
            "competition_id", "seq", name=op.f("uq_score_events_competition_id_seq")
        ),
    )
    op.create_index(
        "ix_score_events_entry_id_problem_id",
        "score_events",
        ["entry_id", "problem_id"],
        unique=False,
    )
    op.create_index(op.f("ix_score_events_person_id"), "score_events", ["person_id"], unique=False)
    op.create_index(
        op.f("ix_score_events_problem_id"), "score_events", ["problem_id"], unique=False
    )


def downgrade() -> None:
    """Go back to the version before."""
    op.drop_index(op.f("ix_score_events_problem_id"), table_name="score_events")
    op.drop_index(op.f("ix_score_events_person_id"), table_name="score_events")
    op.drop_index("ix_score_events_entry_id_problem_id", table_name="score_events")
    op.drop_table("score_events")
    op.drop_index(op.f("ix_competition_waivers_person_id"), table_name="competition_waivers")
    op.drop_index(op.f("ix_competition_waivers_entry_id"), table_name="competition_waivers")
    op.drop_table("competition_waivers")
    op.drop_index(op.f("ix_competition_starters_entry_id"), table_name="competition_starters")
    op.drop_table("competition_starters")
    op.drop_index(op.f("ix_competition_problems_route_id"), table_name="competition_problems")
    op.drop_index(op.f("ix_competition_problems_round_id"), table_name="competition_problems")
    op.drop_table("competition_problems")
    op.drop_index(op.f("ix_competition_entries_person_id"), table_name="competition_entries")
    op.drop_index(op.f("ix_competition_entries_category_id"), table_name="competition_entries")
    op.drop_table("competition_entries")
    op.drop_index(op.f("ix_competition_rounds_competition_id"), table_name="competition_rounds")
    op.drop_table("competition_rounds")
    op.drop_index(
        op.f("ix_competition_categories_competition_id"), table_name="competition_categories"
    )
    op.drop_table("competition_categories")
    op.drop_index(op.f("ix_competitions_gym_id"), table_name="competitions")
    op.drop_table("competitions")

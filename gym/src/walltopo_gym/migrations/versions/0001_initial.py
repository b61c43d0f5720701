"""All tables of the first release."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

from walltopo_gym.database.base import UtcTime

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Create the tables."""
    op.create_table(
        "audit",
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("gym_id", sa.Uuid(), nullable=True),
        sa.Column("action", sa.String(length=40), nullable=False),
        sa.Column("subject", sa.String(length=200), nullable=False),
        sa.Column("details", sa.JSON(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_audit"),
    )
    op.create_index("ix_audit_gym_id", "audit", ["gym_id"])
    op.create_index("ix_audit_person_id", "audit", ["person_id"])

    op.create_table(
        "gyms",
        sa.Column("slug", sa.String(length=60), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("place", sa.String(length=120), nullable=False),
        sa.Column("time_zone", sa.String(length=60), nullable=False),
        sa.Column("visibility", sa.String(length=10), nullable=False),
        sa.Column("joining", sa.String(length=10), nullable=False),
        sa.Column("boards", sa.String(length=10), server_default="one", nullable=False),
        sa.Column("features_off", sa.JSON(), server_default="[]", nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_gyms"),
        sa.UniqueConstraint("slug", name="uq_gyms_slug"),
    )
    op.create_table(
        "mailed_links",
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("email", sa.String(length=320), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_mailed_links"),
        sa.UniqueConstraint("token_hash", name="uq_mailed_links_token_hash"),
    )
    op.create_index("ix_mailed_links_email", "mailed_links", ["email"])

    op.create_table(
        "oidc_attempts",
        sa.Column("state_hash", sa.String(length=64), nullable=False),
        sa.Column("nonce", sa.String(length=64), nullable=False),
        sa.Column("verifier", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_oidc_attempts"),
        sa.UniqueConstraint("state_hash", name="uq_oidc_attempts_state_hash"),
    )
    op.create_table(
        "people",
        sa.Column("email", sa.String(length=320), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("password_hash", sa.String(length=200), nullable=False),
        sa.Column("operator", sa.Boolean(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_people"),
        sa.UniqueConstraint("email", name="uq_people_email"),
    )
    op.create_table(
        "server_secrets",
        sa.Column("name", sa.String(length=40), nullable=False),
        sa.Column("content", sa.Text(), nullable=False),
        sa.PrimaryKeyConstraint("name", name="pk_server_secrets"),
    )
    op.create_table(
        "tries",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("key", sa.String(length=64), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.PrimaryKeyConstraint("id", name="pk_tries"),
    )
    op.create_index("ix_tries_at", "tries", ["at"])
    op.create_index("ix_tries_key_at", "tries", ["key", "at"])

    op.create_table(
        "api_tokens",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("scopes", sa.JSON(), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_api_tokens_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_api_tokens"),
        sa.UniqueConstraint("token_hash", name="uq_api_tokens_token_hash"),
    )
    op.create_index("ix_api_tokens_person_id", "api_tokens", ["person_id"])

    op.create_table(
        "bans",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(["gym_id"], ["gyms.id"], name="fk_bans_gym_id", ondelete="CASCADE"),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_bans_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", "person_id", name="pk_bans"),
    )
    op.create_index("ix_bans_person_id", "bans", ["person_id"])

    op.create_table(
        "challenges",
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("challenge_hash", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_challenges_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_challenges"),
        sa.UniqueConstraint("challenge_hash", name="uq_challenges_challenge_hash"),
    )
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
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_climbing_sessions_gym_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_climbing_sessions_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_climbing_sessions"),
    )
    op.create_index("ix_climbing_sessions_feed", "climbing_sessions", ["gym_id", "began_at"])
    op.create_index(
        "ix_climbing_sessions_of", "climbing_sessions", ["person_id", "gym_id", "began_at"]
    )

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
            ["gym_id"], ["gyms.id"], name="fk_competitions_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competitions"),
    )
    op.create_index("ix_competitions_gym_id", "competitions", ["gym_id"])

    op.create_table(
        "floor_plans",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("sha256", sa.String(length=64), nullable=False),
        sa.Column("width", sa.Integer(), nullable=False),
        sa.Column("height", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_floor_plans_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name="pk_floor_plans"),
    )
    op.create_table(
        "follows",
        sa.Column("follower_id", sa.Uuid(), nullable=False),
        sa.Column("followed_id", sa.Uuid(), nullable=False),
        sa.Column("accepted", sa.Boolean(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["followed_id"], ["people.id"], name="fk_follows_followed_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["follower_id"], ["people.id"], name="fk_follows_follower_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("follower_id", "followed_id", name="pk_follows"),
    )
    op.create_index("ix_follows_followed_id", "follows", ["followed_id"])

    op.create_table(
        "grade_systems",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=60), nullable=False),
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("grades", sa.JSON(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_grade_systems_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_grade_systems"),
        sa.UniqueConstraint("gym_id", "name", name="uq_grade_systems_gym_id_name"),
    )
    op.create_table(
        "gym_aims",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("targets", sa.JSON(), nullable=False),
        sa.Column("stock", sa.JSON(), nullable=False),
        sa.Column("wash_after", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_gym_aims_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name="pk_gym_aims"),
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
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_hall_settings_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", name="pk_hall_settings"),
        sa.UniqueConstraint("key_hash", name="uq_hall_settings_key_hash"),
    )
    op.create_table(
        "identities",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("issuer", sa.String(length=300), nullable=False),
        sa.Column("subject", sa.String(length=255), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_identities_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_identities"),
        sa.UniqueConstraint("issuer", "subject", name="uq_identities_issuer_subject"),
    )
    op.create_index("ix_identities_person_id", "identities", ["person_id"])

    op.create_table(
        "invitations",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("role", sa.String(length=10), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("uses", sa.Integer(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_invitations_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_invitations"),
        sa.UniqueConstraint("token_hash", name="uq_invitations_token_hash"),
    )
    op.create_index("ix_invitations_gym_id", "invitations", ["gym_id"])

    op.create_table(
        "known_browsers",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_known_browsers_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_known_browsers"),
        sa.UniqueConstraint("token_hash", name="uq_known_browsers_token_hash"),
    )
    op.create_index("ix_known_browsers_person_id", "known_browsers", ["person_id"])

    op.create_table(
        "memberships",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("role", sa.String(length=10), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_memberships_gym_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_memberships_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", "person_id", name="pk_memberships"),
    )
    op.create_index("ix_memberships_person_id", "memberships", ["person_id"])

    op.create_table(
        "messages",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("kind", sa.String(length=20), nullable=False),
        sa.Column("subject", sa.String(length=80), nullable=False),
        sa.Column("target", sa.String(length=36), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.Column("sent_at", UtcTime(), nullable=True),
        sa.Column("error", sa.String(length=300), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_messages_gym_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_messages_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_messages"),
        sa.UniqueConstraint(
            "person_id",
            "kind",
            "subject",
            "target",
            name="uq_messages_person_id_kind_subject_target",
        ),
    )
    op.create_index("ix_messages_gym_id", "messages", ["gym_id"])

    op.create_table(
        "passkeys",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("credential_id", sa.LargeBinary(length=1023), nullable=False),
        sa.Column("public_key", sa.LargeBinary(), nullable=False),
        sa.Column("sign_count", sa.Integer(), nullable=False),
        sa.Column("used_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_passkeys_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_passkeys"),
        sa.UniqueConstraint("credential_id", name="uq_passkeys_credential_id"),
    )
    op.create_index("ix_passkeys_person_id", "passkeys", ["person_id"])

    op.create_table(
        "profiles",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("on_boards", sa.Boolean(), nullable=False),
        sa.Column("category", sa.String(length=10), nullable=False),
        sa.Column("birth_year", sa.Integer(), nullable=True),
        sa.Column("show_ascents", sa.String(length=10), nullable=False),
        sa.Column("show_pins", sa.String(length=10), nullable=False),
        sa.Column("show_body", sa.String(length=10), nullable=False),
        sa.Column("height_cm", sa.Integer(), nullable=True),
        sa.Column("reach_cm", sa.Integer(), nullable=True),
        sa.Column("changed_at", UtcTime(), nullable=False),
        sa.Column("feed", sa.Boolean(), server_default=sa.true(), nullable=False),
        sa.Column("on_screens", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_profiles_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("person_id", name="pk_profiles"),
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
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_push_addresses_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_push_addresses"),
        sa.UniqueConstraint("endpoint", name="uq_push_addresses_endpoint"),
    )
    op.create_index("ix_push_addresses_person_id", "push_addresses", ["person_id"])

    op.create_table(
        "recovery_codes",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("code_hash", sa.String(length=64), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_recovery_codes_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_recovery_codes"),
    )
    op.create_index("ix_recovery_codes_person_id", "recovery_codes", ["person_id"])

    op.create_table(
        "second_factors",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("secret", sa.String(length=64), nullable=False),
        sa.Column("last_step", sa.Integer(), nullable=False),
        sa.Column("confirmed_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_second_factors_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_second_factors"),
        sa.UniqueConstraint("person_id", name="uq_second_factors_person_id"),
    )
    op.create_table(
        "session_marks",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("kind", sa.String(length=5), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_session_marks_gym_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_session_marks_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_session_marks"),
    )
    op.create_index("ix_session_marks_gym_id", "session_marks", ["gym_id"])
    op.create_index("ix_session_marks_of", "session_marks", ["person_id", "gym_id", "at"])

    op.create_table(
        "sign_ins",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("token_hash", sa.String(length=64), nullable=False),
        sa.Column("expires_at", UtcTime(), nullable=False),
        sa.Column("browser", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_sign_ins_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_sign_ins"),
        sa.UniqueConstraint("token_hash", name="uq_sign_ins_token_hash"),
    )
    op.create_index("ix_sign_ins_person_id", "sign_ins", ["person_id"])

    op.create_table(
        "standings",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("period", sa.String(length=7), nullable=False),
        sa.Column("circuit", sa.String(length=80), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("points", sa.Integer(), nullable=False),
        sa.Column("tops", sa.Integer(), nullable=False),
        sa.Column("flashes", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_standings_gym_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_standings_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("gym_id", "period", "circuit", "person_id", name="pk_standings"),
    )
    op.create_index("ix_standings_order", "standings", ["gym_id", "period", "circuit", "points"])
    op.create_index("ix_standings_person_id", "standings", ["person_id"])

    op.create_table(
        "walls",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.Column("zone", sa.String(length=80), server_default="", nullable=False),
        sa.Column("published_scan_id", sa.Uuid(), nullable=True),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("plan_x", sa.Double(), nullable=True),
        sa.Column("plan_y", sa.Double(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_walls_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_walls"),
        sa.UniqueConstraint("gym_id", "name", name="uq_walls_gym_id_name"),
    )
    op.create_table(
        "webhooks",
        sa.Column("gym_id", sa.Uuid(), nullable=False),
        sa.Column("url", sa.String(length=500), nullable=False),
        sa.Column("secret", sa.String(length=100), nullable=False),
        sa.Column("last_delivered_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_webhooks_gym_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_webhooks"),
    )
    op.create_index("ix_webhooks_gym_id", "webhooks", ["gym_id"])

    op.create_table(
        "notification_preferences",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("language", sa.String(length=2), nullable=False),
        sa.Column("digest", sa.Boolean(), nullable=False),
        sa.Column("new_routes", sa.Boolean(), nullable=False),
        sa.Column("soon", sa.Boolean(), nullable=False),
        sa.Column("competitions", sa.Boolean(), nullable=False),
        sa.Column("hold_reports", sa.Boolean(), nullable=False),
        sa.Column("quiet_from", sa.Integer(), nullable=False),
        sa.Column("quiet_to", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_wishes_person_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("person_id", name="pk_wishes"),
    )
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
            name="fk_competition_categories_competition_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competition_categories"),
    )
    op.create_index(
        "ix_competition_categories_competition_id", "competition_categories", ["competition_id"]
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
            name="fk_competition_rounds_competition_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competition_rounds"),
    )
    op.create_index(
        "ix_competition_rounds_competition_id", "competition_rounds", ["competition_id"]
    )

    op.create_table(
        "device_sign_ins",
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
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_device_sign_ins_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["sign_in_id"],
            ["sign_ins.id"],
            name="fk_device_sign_ins_sign_in_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_device_sign_ins"),
        sa.UniqueConstraint("claim_hash", name="uq_device_sign_ins_claim_hash"),
        sa.UniqueConstraint("offer_hash", name="uq_device_sign_ins_offer_hash"),
    )
    op.create_index("ix_device_sign_ins_person_id", "device_sign_ins", ["person_id"])

    op.create_table(
        "routes",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=80), nullable=False),
        sa.Column("colour", sa.String(length=40), nullable=False),
        sa.Column("grade_system_id", sa.Uuid(), nullable=True),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("setter", sa.String(length=80), nullable=False),
        sa.Column("tags", sa.JSON(), nullable=False),
        sa.Column("set_on", sa.Date(), nullable=False),
        sa.Column("strip_on", sa.Date(), nullable=True),
        sa.Column("stripped_at", UtcTime(), nullable=True),
        sa.Column("by_hand", sa.Boolean(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["grade_system_id"],
            ["grade_systems.id"],
            name="fk_routes_grade_system_id",
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_routes_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_routes"),
    )
    op.create_index("ix_routes_grade_system_id", "routes", ["grade_system_id"])
    op.create_index("ix_routes_stripped_at", "routes", ["stripped_at"])
    op.create_index("ix_routes_wall_id", "routes", ["wall_id"])

    op.create_table(
        "scans",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("made_by", sa.Uuid(), nullable=True),
        sa.Column("state", sa.String(length=12), nullable=False),
        sa.Column("run", sa.Integer(), nullable=False),
        sa.Column("batches", sa.Integer(), nullable=False),
        sa.Column("reference_id", sa.Uuid(), nullable=True),
        sa.Column("amends_id", sa.Uuid(), nullable=True),
        sa.Column("error", sa.String(length=2000), nullable=False),
        sa.Column("hint", sa.String(length=2000), nullable=False),
        sa.Column("files", sa.JSON(), nullable=False),
        sa.Column("scale", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("distance", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("part", sa.Boolean(), server_default=sa.text("false"), nullable=False),
        sa.Column("moves", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("published_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["amends_id"], ["scans.id"], name="fk_scans_amends_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["made_by"], ["people.id"], name="fk_scans_made_by", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["reference_id"], ["scans.id"], name="fk_scans_reference_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_scans_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_scans"),
    )
    op.create_index("ix_scans_amends_id", "scans", ["amends_id"])
    op.create_index("ix_scans_reference_id", "scans", ["reference_id"])
    op.create_index("ix_scans_state", "scans", ["state"])
    op.create_index("ix_scans_wall_id", "scans", ["wall_id"])

    op.create_table(
        "washings",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("washed_at", UtcTime(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_washings_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_washings"),
    )
    op.create_index("ix_washings_last", "washings", ["wall_id", "washed_at"])

    op.create_table(
        "webhook_events",
        sa.Column("webhook_id", sa.Uuid(), nullable=False),
        sa.Column("body", sa.JSON(), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("next_at", UtcTime(), nullable=False),
        sa.Column("error", sa.String(length=300), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["webhook_id"], ["webhooks.id"], name="fk_webhook_events_webhook_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_webhook_events"),
    )
    op.create_index("ix_webhook_events_webhook_id", "webhook_events", ["webhook_id"])

    op.create_table(
        "ascents",
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("gym_id", sa.Uuid(), nullable=True),
        sa.Column("route_id", sa.Uuid(), nullable=True),
        sa.Column("gym_name", sa.String(length=80), nullable=False),
        sa.Column("route_name", sa.String(length=80), nullable=False),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("tries", sa.Integer(), nullable=False),
        sa.Column("note", sa.String(length=500), nullable=False),
        sa.Column("climbed_at", UtcTime(), nullable=False),
        sa.Column("taken_back_at", UtcTime(), nullable=True),
        sa.Column("worth", sa.Integer(), nullable=True),
        sa.Column("circuit", sa.String(length=80), server_default="", nullable=False),
        sa.Column("climbed_route", sa.Uuid(), nullable=True),
        sa.Column("pinned_at", UtcTime(), nullable=True),
        sa.Column("edited_at", UtcTime(), nullable=True),
        sa.Column("edited_by", sa.Uuid(), nullable=True),
        sa.Column("edits", sa.JSON(), server_default="{}", nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["gym_id"], ["gyms.id"], name="fk_ascents_gym_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_ascents_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_ascents_route_id", ondelete="SET NULL"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_ascents"),
    )
    op.create_index(
        "ix_ascents_counts", "ascents", ["route_id", "kind", "person_id", "taken_back_at"]
    )
    op.create_index("ix_ascents_gym_id", "ascents", ["gym_id"])
    op.create_index("ix_ascents_person_id_climbed_at", "ascents", ["person_id", "climbed_at"])
    op.create_index(
        "ix_ascents_person_id_gym_id_climbed_at", "ascents", ["person_id", "gym_id", "climbed_at"]
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
        sa.Column("removed", sa.Boolean(), server_default=sa.false(), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["category_id"],
            ["competition_categories.id"],
            name="fk_competition_entries_category_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["competition_id"],
            ["competitions.id"],
            name="fk_competition_entries_competition_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name="fk_competition_entries_person_id",
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competition_entries"),
        sa.UniqueConstraint(
            "competition_id", "bib", name="uq_competition_entries_competition_id_bib"
        ),
        sa.UniqueConstraint(
            "competition_id", "person_id", name="uq_competition_entries_competition_id_person_id"
        ),
    )
    op.create_index("ix_competition_entries_category_id", "competition_entries", ["category_id"])
    op.create_index("ix_competition_entries_person_id", "competition_entries", ["person_id"])

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
            name="fk_competition_problems_round_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["route_id"],
            ["routes.id"],
            name="fk_competition_problems_route_id",
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competition_problems"),
    )
    op.create_index("ix_competition_problems_round_id", "competition_problems", ["round_id"])
    op.create_index("ix_competition_problems_route_id", "competition_problems", ["route_id"])

    op.create_table(
        "hidden_comments",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_hidden_comments_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_hidden_comments_route_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("route_id", "person_id", name="pk_hidden_comments"),
    )
    op.create_index("ix_hidden_comments_person_id", "hidden_comments", ["person_id"])

    op.create_table(
        "hold_reports",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("route_id", sa.Uuid(), nullable=True),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("hold", sa.Integer(), nullable=True),
        sa.Column("colour", sa.String(length=40), nullable=False),
        sa.Column("kind", sa.String(length=10), nullable=False),
        sa.Column("note", sa.String(length=300), nullable=False),
        sa.Column("done_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_hold_reports_person_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_hold_reports_route_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_hold_reports_scan_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_hold_reports_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_hold_reports"),
    )
    op.create_index("ix_hold_reports_of_wall", "hold_reports", ["wall_id", "done_at", "created_at"])
    op.create_index("ix_hold_reports_person_id", "hold_reports", ["person_id"])
    op.create_index("ix_hold_reports_route_id", "hold_reports", ["route_id"])
    op.create_index("ix_hold_reports_scan_id", "hold_reports", ["scan_id"])

    op.create_table(
        "reset_plans",
        sa.Column("wall_id", sa.Uuid(), nullable=False),
        sa.Column("day", sa.Date(), nullable=False),
        sa.Column("note", sa.String(length=500), nullable=False),
        sa.Column("wishes", sa.JSON(), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("published_at", UtcTime(), nullable=True),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["wall_id"], ["walls.id"], name="fk_reset_plans_wall_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_reset_plans"),
    )
    op.create_index("ix_reset_plans_wall_id", "reset_plans", ["wall_id"])

    op.create_table(
        "reset_people",
        sa.Column("plan_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("part", sa.String(length=10), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_reset_people_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["plan_id"], ["reset_plans.id"], name="fk_reset_people_plan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("plan_id", "person_id", "part", name="pk_reset_people"),
    )
    op.create_index("ix_reset_people_person_id", "reset_people", ["person_id"])

    op.create_table(
        "grade_proposals",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("grade_system_id", sa.Uuid(), nullable=True),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("risk", sa.Integer(), nullable=True),
        sa.Column("intensity", sa.Integer(), nullable=True),
        sa.Column("complexity", sa.Integer(), nullable=True),
        sa.Column("note", sa.String(length=300), nullable=False),
        sa.Column("changed_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["grade_system_id"],
            ["grade_systems.id"],
            name="fk_grade_proposals_grade_system_id",
            ondelete="SET NULL",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_grade_proposals_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_grade_proposals_route_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("route_id", "person_id", name="pk_grade_proposals"),
    )
    op.create_index("ix_grade_proposals_grade_system_id", "grade_proposals", ["grade_system_id"])
    op.create_index("ix_grade_proposals_person_id", "grade_proposals", ["person_id"])

    op.create_table(
        "route_sign_offs",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=True),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("signed_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_route_sign_offs_person_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_route_sign_offs_route_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("route_id", name="pk_route_sign_offs"),
    )
    op.create_index("ix_route_sign_offs_person_id", "route_sign_offs", ["person_id"])

    op.create_table(
        "opinions",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("grade", sa.String(length=80), nullable=False),
        sa.Column("stars", sa.Integer(), nullable=True),
        sa.Column("wish", sa.String(length=10), nullable=False),
        sa.Column("comment", sa.String(length=500), nullable=False),
        sa.Column("changed_at", UtcTime(), nullable=False),
        sa.Column("edited_at", UtcTime(), nullable=True),
        sa.Column("edited_by", sa.Uuid(), nullable=True),
        sa.Column("edits", sa.JSON(), server_default="{}", nullable=False),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_opinions_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_opinions_route_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("route_id", "person_id", name="pk_opinions"),
    )
    op.create_index("ix_opinions_newest", "opinions", ["route_id", "changed_at"])
    op.create_index("ix_opinions_person_id", "opinions", ["person_id"])

    op.create_table(
        "photo_overlaps",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("requested", sa.Integer(), nullable=False),
        sa.Column("answered", sa.Integer(), nullable=False),
        sa.Column("groups", sa.JSON(), nullable=False),
        sa.Column("shifts", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_photo_overlaps_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_photo_overlaps"),
    )
    op.create_table(
        "photos",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("name", sa.String(length=200), nullable=False),
        sa.Column("size", sa.BigInteger(), nullable=False),
        sa.Column("state", sa.String(length=10), nullable=False),
        sa.Column("reason", sa.String(length=500), nullable=False),
        sa.Column("batch", sa.Integer(), nullable=True),
        sa.Column("sha256", sa.String(length=64), nullable=True),
        sa.Column("width", sa.Integer(), nullable=True),
        sa.Column("height", sa.Integer(), nullable=True),
        sa.Column("sharpness", sa.Double(), nullable=True),
        sa.Column("frames", sa.Integer(), server_default="1", nullable=False),
        sa.Column("plate_frames", sa.Integer(), server_default="0", nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_photos_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_photos"),
    )
    op.create_index("ix_photos_scan_id", "photos", ["scan_id"])
    op.create_index("ix_photos_sha256", "photos", ["sha256"])
    op.create_index("ix_photos_state", "photos", ["state"])

    op.create_table(
        "placements",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("holds", sa.JSON(), nullable=False),
        sa.Column("steepness_deg", sa.Double(), nullable=True),
        sa.Column("hold_types", sa.JSON(), nullable=False),
        sa.Column("as_was", sa.JSON(none_as_null=True), nullable=True),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_placements_route_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_placements_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", "number", name="pk_placements"),
    )
    op.create_index("ix_placements_route_id", "placements", ["route_id"])

    op.create_table(
        "plans",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("over_id", sa.Uuid(), nullable=True),
        sa.Column("made_by", sa.Uuid(), nullable=True),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.Column("at", UtcTime(), nullable=True),
        sa.Column("entries", sa.JSON(), nullable=False),
        sa.Column("found", sa.JSON(), nullable=False),
        sa.Column("error", sa.String(length=500), nullable=False),
        sa.ForeignKeyConstraint(
            ["made_by"], ["people.id"], name="fk_plans_made_by", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_plans_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_plans"),
    )
    op.create_table(
        "reports",
        sa.Column("route_id", sa.Uuid(), nullable=False),
        sa.Column("author_id", sa.Uuid(), nullable=False),
        sa.Column("person_id", sa.Uuid(), nullable=False),
        sa.Column("comment", sa.String(length=500), nullable=False),
        sa.Column("reason", sa.String(length=200), nullable=False),
        sa.Column("id", sa.Uuid(), nullable=False),
        sa.Column("created_at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["author_id"], ["people.id"], name="fk_reports_author_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_reports_person_id", ondelete="CASCADE"
        ),
        sa.ForeignKeyConstraint(
            ["route_id"], ["routes.id"], name="fk_reports_route_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("id", name="pk_reports"),
        sa.UniqueConstraint(
            "route_id", "author_id", "person_id", name="uq_reports_route_id_author_id_person_id"
        ),
    )
    op.create_index("ix_reports_author_id", "reports", ["author_id"])
    op.create_index("ix_reports_person_id", "reports", ["person_id"])

    op.create_table(
        "scan_edits",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("revision", sa.Integer(), nullable=False),
        sa.Column("shown", sa.Integer(), nullable=False),
        sa.Column("log", sa.JSON(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_scan_edits_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_scan_edits"),
    )
    op.create_table(
        "scan_places",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("model", sa.String(length=16), nullable=False),
        sa.Column("shown", sa.Integer(), nullable=False),
        sa.Column("learnt", sa.JSON(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_scan_places_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_scan_places"),
    )
    op.create_table(
        "scan_progress",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("stage", sa.String(length=20), nullable=False),
        sa.Column("doing", sa.String(length=200), nullable=False),
        sa.Column("done", sa.Integer(), nullable=False),
        sa.Column("total", sa.Integer(), nullable=True),
        sa.Column("notes", sa.JSON(), nullable=False),
        sa.Column("at", UtcTime(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"], ["scans.id"], name="fk_scan_progress_scan_id", ondelete="CASCADE"
        ),
        sa.PrimaryKeyConstraint("scan_id", name="pk_scan_progress"),
    )
    op.create_table(
        "competition_starters",
        sa.Column("round_id", sa.Uuid(), nullable=False),
        sa.Column("entry_id", sa.Uuid(), nullable=False),
        sa.Column("place", sa.Integer(), nullable=False),
        sa.ForeignKeyConstraint(
            ["entry_id"],
            ["competition_entries.id"],
            name="fk_competition_starters_entry_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["round_id"],
            ["competition_rounds.id"],
            name="fk_competition_starters_round_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("round_id", "entry_id", name="pk_competition_starters"),
    )
    op.create_index("ix_competition_starters_entry_id", "competition_starters", ["entry_id"])

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
            name="fk_competition_waivers_entry_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"],
            ["people.id"],
            name="fk_competition_waivers_person_id",
            ondelete="SET NULL",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_competition_waivers"),
    )
    op.create_index("ix_competition_waivers_entry_id", "competition_waivers", ["entry_id"])
    op.create_index("ix_competition_waivers_person_id", "competition_waivers", ["person_id"])

    op.create_table(
        "placed_routes",
        sa.Column("scan_id", sa.Uuid(), nullable=False),
        sa.Column("number", sa.Integer(), nullable=False),
        sa.Column("place", sa.Double(), nullable=False),
        sa.Column("known", sa.Boolean(), nullable=False),
        sa.ForeignKeyConstraint(
            ["scan_id"],
            ["scan_places.scan_id"],
            name="fk_placed_routes_scan_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("scan_id", "number", name="pk_placed_routes"),
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
            name="fk_score_events_competition_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["entry_id"],
            ["competition_entries.id"],
            name="fk_score_events_entry_id",
            ondelete="CASCADE",
        ),
        sa.ForeignKeyConstraint(
            ["person_id"], ["people.id"], name="fk_score_events_person_id", ondelete="SET NULL"
        ),
        sa.ForeignKeyConstraint(
            ["problem_id"],
            ["competition_problems.id"],
            name="fk_score_events_problem_id",
            ondelete="CASCADE",
        ),
        sa.PrimaryKeyConstraint("id", name="pk_score_events"),
        sa.UniqueConstraint("competition_id", "seq", name="uq_score_events_competition_id_seq"),
    )
    op.create_index(
        "ix_score_events_entry_id_problem_id", "score_events", ["entry_id", "problem_id"]
    )
    op.create_index("ix_score_events_person_id", "score_events", ["person_id"])
    op.create_index("ix_score_events_problem_id", "score_events", ["problem_id"])
    # Walls and scans name each other.
    with op.batch_alter_table("walls") as batch_op:
        batch_op.create_foreign_key(
            "fk_walls_published_scan_id",
            "scans",
            ["published_scan_id"],
            ["id"],
            ondelete="SET NULL",
        )

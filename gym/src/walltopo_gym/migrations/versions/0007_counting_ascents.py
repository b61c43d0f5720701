"""An index from which ascents are counted."""

from __future__ import annotations

from alembic import op

revision = "0007"
down_revision = "0006"
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Go to this version."""
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.drop_index("ix_ascents_route_id")
        batch_op.create_index(
            "ix_ascents_counts", ["route_id", "kind", "person_id", "taken_back_at"]
        )


def downgrade() -> None:
    """Go back to the version before."""
    with op.batch_alter_table("ascents", schema=None) as batch_op:
        batch_op.drop_index("ix_ascents_counts")
        batch_op.create_index("ix_ascents_route_id", ["route_id"])

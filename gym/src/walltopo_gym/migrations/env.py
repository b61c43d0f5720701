"""Alembic's entry point: runs on the connection of `run.migrate`."""

from __future__ import annotations

from typing import Any, Literal

from alembic import context

from walltopo_gym.database.base import UtcTime
from walltopo_gym.migrations.tables import METADATA, is_ours


def _rendered(kind: str, item: Any, _: Any) -> str | Literal[False]:
    """Return the source text of our own column type for a new revision."""
    return "UtcTime()" if kind == "type" and isinstance(item, UtcTime) else False


context.configure(
    connection=context.config.attributes["connection"],
    target_metadata=METADATA,
    # SQLite changes a table by making it anew.
    render_as_batch=True,
    render_item=_rendered,
    include_name=is_ours,
    # The transaction is the caller's.
    transactional_ddl=False,
)
context.run_migrations()

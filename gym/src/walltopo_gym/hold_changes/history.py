"""The changes of a hold between scans, for its history."""

from __future__ import annotations

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.events import HoldHistoryOf, HoldMoment
from walltopo_gym.hold_changes.models import HoldChange, HoldComparison


def add_changes(session: Session, question: HoldHistoryOf) -> None:
    """Answer with the scans in which a hold has turned or moved."""
    here = question.rows_of(HoldChange.scan_id, HoldChange.hold)
    rows = session.execute(
        select(HoldChange, HoldComparison.created_at)
        .join(HoldComparison, HoldComparison.scan_id == HoldChange.scan_id)
        .where(here, HoldChange.kind.in_(("turned", "moved")))
        .order_by(HoldComparison.created_at.desc())
        .limit(question.most)
    )
    question.found.extend(HoldMoment(at, row.kind, _amount_text(row)) for row, at in rows)


def _amount_text(row: HoldChange) -> str:
    """Return how far a hold turned or moved, in words; empty if unknown."""
    if row.kind == "turned" and row.turn_deg is not None:
        return f"{abs(row.turn_deg):.0f}°"
    return "" if row.moved_m is None else f"{100 * row.moved_m:.0f} cm"

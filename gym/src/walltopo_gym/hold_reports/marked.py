"""Reports of holds that setters check, and in the history of a hold."""

from __future__ import annotations

from typing import Final

from sqlalchemy import select
from sqlalchemy.orm import Session

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.events import HoldHistoryOf, HoldMarked, HoldMoment
from walltopo_gym.hold_reports.models import HoldReport
from walltopo_gym.hold_reports.service import close_reports_before

_REPAIRS: Final = ("tightened", "washed", "removed")


def close_marked(session: Session, event: HoldMarked) -> None:
    """Close the reports of a hold that was repaired after they were made."""
    if event.mark not in _REPAIRS:
        return
    place = event.scan, event.hold
    closed = close_reports_before(session, event.gym, event.wall, place, event.at)
    if closed:
        log_change(
            session,
            "hold.done",
            person=event.person,
            gym=event.gym,
            subject=str(closed[0].id),
            wall=str(event.wall),
        )


def add_reports(session: Session, question: HoldHistoryOf) -> None:
    """Answer with the latest reports of a hold, and when they were closed."""
    here = question.rows_of(HoldReport.scan_id, HoldReport.hold)
    rows = select(HoldReport).where(here).order_by(HoldReport.created_at.desc())
    for report in session.scalars(rows.limit(question.most)):
        kind = report.kind
        made = HoldMoment(report.created_at, "reported", report.note, fault=kind)
        question.found.append(made)
        if report.done_at is not None:
            question.found.append(HoldMoment(report.done_at, "report-closed", fault=kind))

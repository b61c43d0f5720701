"""The queued mails: their state, and the next try of those that wait."""

from __future__ import annotations

from typing import Final
from uuid import UUID

from walltopo_gym.accounts.audit import log_change
from walltopo_gym.database.engine import Database
from walltopo_gym.database.lock import check_unlocked
from walltopo_gym.events import MailQueue, MailQueueOf, collect_answers

_MAX: Final = 1000  # mails that are tried anew at once


def mail_queue(database: Database) -> MailQueue:
    """Return the state of the queued mails."""
    with database.reading() as session:
        (found,) = collect_answers(session, MailQueueOf())
    return found


def send_waiting(database: Database, by: UUID | None = None) -> int:
    """Let the mails that wait for their next try be sent now; return their number.

    Parameters
    ----------
    by : the operator; None: by command.
    """
    job = mail_queue(database).job
    check_unlocked("jobs are listed")
    delayed = database.jobs.list_workflows(
        name=job, status="DELAYED", limit=_MAX, load_input=False, load_output=False
    )
    for workflow in delayed:
        database.jobs.set_workflow_delay(workflow.workflow_id, delay_seconds=0)
    with database.writing() as session:
        log_change(session, "mail.send-waiting", person=by, count=len(delayed))
    return len(delayed)

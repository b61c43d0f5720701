"""Messages to people, as a feature of the platform."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from threading import Event
from typing import TYPE_CHECKING

from sqlalchemy.orm import Session

from walltopo_gym.database.engine import Database
from walltopo_gym.events import (
    CompetitionBegins,
    HoldReportDone,
    HoldReported,
    HoldsChanged,
    InspectionDue,
    MailQueueOf,
    OwnTables,
    RoutesToForerun,
)
from walltopo_gym.feature import Feature
from walltopo_gym.notifications import happened
from walltopo_gym.notifications.models import Message, NotificationPreferences, PushAddress
from walltopo_gym.settings import GymSettings
from walltopo_gym.storage.files import FileStore

if TYPE_CHECKING:
    from walltopo_gym.jobs.queue import Task
    from walltopo_gym.jobs.worker import Chore


def _tasks(
    settings: GymSettings, database: Database, store: FileStore, stopping: Event
) -> Sequence[Task]:
    from walltopo_gym.jobs.queue import Task
    from walltopo_gym.mail import make_mailer
    from walltopo_gym.notifications.messages import MAILS, PUSHES
    from walltopo_gym.notifications.sending import MessageSender, record_failure

    sender = MessageSender(settings, database, make_mailer(settings))
    return [Task(MAILS, sender.mail, record_failure), Task(PUSHES, sender.push, record_failure)]


def _chores(settings: GymSettings, database: Database) -> Sequence[Chore]:
    from walltopo_gym.jobs.worker import Chore
    from walltopo_gym.notifications.due import store_due_messages

    return [Chore("note-messages", "* * * * *", partial(store_due_messages, database))]


def _own_tables(session: Session, question: OwnTables) -> None:
    question.found.extend(
        [
            ("notification_preferences", NotificationPreferences),
            ("push_addresses", PushAddress),
            ("messages", Message),
        ]
    )


def _mail_queue(session: Session, question: MailQueueOf) -> None:
    from walltopo_gym.notifications.sending import answer_mail_queue

    answer_mail_queue(session, question)


FEATURE = Feature(
    "notifications",
    listeners={
        HoldReported: (happened.hold_reported,),
        HoldReportDone: (happened.hold_report_done,),
        HoldsChanged: (happened.holds_changed,),
        InspectionDue: (happened.inspection_due,),
        RoutesToForerun: (happened.routes_to_forerun,),
        CompetitionBegins: (happened.competition_begins,),
    },
    data_listeners={OwnTables: (_own_tables,), MailQueueOf: (_mail_queue,)},
    tasks=_tasks,
    chores=_chores,
)

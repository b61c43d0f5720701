"""`walltopo gym doctor|workers|storage|mail|gym|jobs|purge|recount`: commands for operators."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING
from uuid import UUID

from walltopo.cli.options import Number
from walltopo.core import EnvironmentLacksError, InputError, SettingsError
from walltopo_gym.cli.options import add_gym_data_options

if TYPE_CHECKING:
    from sqlalchemy.orm import Session


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the operator's commands."""
    doctor = inner.add_parser("doctor", help="what is well with this installation, what is not")
    doctor.set_defaults(run=_doctor)
    purge = inner.add_parser("purge", help="delete what has expired and what nothing names")
    purge.add_argument("--dry-run", action="store_true", help="only say what would go")
    purge.set_defaults(run=_purge)
    gyms = inner.add_parser(
        "gym", help="list the gyms, open one, or limit its storage and features"
    )
    gyms.add_argument("what", choices=("list", "add", "limit"))
    gyms.add_argument(
        "name", nargs="?", help="(add) of the new gym; (limit) its part of the address"
    )
    gyms.add_argument("--owner", metavar="EMAIL", help="(add) whose it is")
    quota = Number(int, 0, 100_000_000)
    gyms.add_argument(
        "--quota", type=quota, metavar="MB", help="(limit) storage; default: no limit"
    )
    gyms.add_argument(
        "--off", nargs="*", default=[], metavar="FEATURE", help="(limit) features to turn off"
    )
    gyms.set_defaults(run=_gym)
    jobs = inner.add_parser("jobs", help="list the scans that are at work, wait or failed")
    jobs.add_argument("what", choices=("list", "retry", "cancel"), nargs="?", default="list")
    jobs.add_argument("id", nargs="?", help="(retry, cancel) of a scan; (retry) of another job")
    jobs.set_defaults(run=_jobs)
    again = inner.add_parser("recount", help="count sessions and standings anew from all ascents")
    again.add_argument("gym", nargs="?", metavar="SLUG", help="one gym (default: all)")
    again.set_defaults(run=_recount)
    mail = inner.add_parser("mail", help="try the mail server, list what waits, or send it now")
    mail.add_argument("what", choices=("test", "queue", "send"))
    mail.add_argument("to", metavar="ADDRESS", nargs="?", help="(test) who gets it")
    mail.set_defaults(run=_mail)
    workers = inner.add_parser(
        "workers", help="list the workers with version and last sign of life"
    )
    workers.set_defaults(run=_workers)
    storage = inner.add_parser("storage", help="measure disk and files by gym and kind")
    storage.set_defaults(run=_storage)
    for command in (mail, doctor, workers, storage, purge, gyms, jobs, again):
        add_gym_data_options(command)


def _doctor(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import settings_of
    from walltopo_gym.operating.doctor import examine

    sign = {"well": "✓", "look": "!", "bad": "✗"}
    is_bad = False
    for found in examine(settings_of(args)):
        is_bad |= found.state == "bad"
        line = f"{sign[found.state]} {found.what:<9} {found.message}"
        console.print(line, soft_wrap=True, markup=False, highlight=False)
        if found.mend:
            mend = f"            {found.mend}"
            console.print(mend, soft_wrap=True, markup=False, highlight=False)
    return 1 if is_bad else 0


def _mail(args: argparse.Namespace) -> int:
    if args.what == "test":
        return _mail_test(args)
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options
    from walltopo_gym.operating.mail_queue import mail_queue, send_waiting

    with database_of_options(args) as database:
        if args.what == "send":
            console.print(f"{send_waiting(database)} mails are sent now")
        found = mail_queue(database)
    console.print(f"{found.waiting} mails wait, {found.failed} failed in the last 30 days")
    if found.error:
        console.print(f"! {found.error}", soft_wrap=True, markup=False, highlight=False)
    return 0


def _mail_test(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import settings_of
    from walltopo_gym.mail import Mail, SmtpMailer, sender_of

    settings = settings_of(args)
    if not args.to:
        raise InputError("a test mail needs an address", "walltopo gym mail test ADDRESS")
    if not settings.smtp_host:
        raise SettingsError("no mail server is set", "Set smtp_host in gym.toml.")
    text = f"This mail was sent by {settings.link_base} to try its mail server."
    try:
        SmtpMailer(settings).hand_over(Mail(args.to, "Mail from your gym's server works", text))
    except OSError as error:
        raise EnvironmentLacksError(
            f"{settings.smtp_host} did not take the mail: {error}",
            "Check smtp_host, smtp_port, smtp_security, smtp_user and smtp_password.",
        ) from error
    console.print(f"sent to {args.to} from {sender_of(settings)} by {settings.smtp_host}")
    return 0


def _purge(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options, settings_of
    from walltopo_gym.operating.purge import purge
    from walltopo_gym.storage.files import open_store

    settings = settings_of(args)
    with database_of_options(args) as database:
        gone = purge(settings, database, open_store(settings), really=not args.dry_run)
    verb = "would go" if args.dry_run else "gone"
    console.print(f"{gone.rows} rows, {len(gone.files)} files, {gone.bytes / 1e6:.1f} MB {verb}")
    for name, why in gone.failed:
        console.print(f"! {name}: {why}", soft_wrap=True, markup=False, highlight=False)
    return 0


def _recount(args: argparse.Namespace) -> int:
    from sqlalchemy import select

    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options
    from walltopo_gym.climbing.counting import recount_gym
    from walltopo_gym.gyms.models import Gym

    with database_of_options(args) as database:
        wanted = select(Gym).order_by(Gym.slug)
        if args.gym:
            wanted = wanted.where(Gym.slug == args.gym)
        with database.reading() as session:
            gyms = session.scalars(wanted).all()
        if args.gym and not gyms:
            raise InputError(f"there is no gym {args.gym!r}", "`walltopo gym gym list` lists them.")
        for gym in gyms:
            line = f"{gym.slug}: {recount_gym(database, gym.id)} climbers counted"
            console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0


def _gym(args: argparse.Namespace) -> int:
    from sqlalchemy import select

    from walltopo.cli.console import console
    from walltopo_gym.accounts.people import find_person, normalise_email
    from walltopo_gym.cli.gym_data import database_of_options
    from walltopo_gym.gyms.models import Gym
    from walltopo_gym.gyms.service import open_gym

    with database_of_options(args) as database, database.writing() as session:
        if args.what == "add":
            if not args.name or not args.owner:
                raise InputError("a new gym needs a name and an owner", "NAME --owner EMAIL")
            owner = find_person(session, normalise_email(args.owner))
            if owner is None:
                raise InputError(f"{args.owner}: no account", "`walltopo gym user add` makes one.")
            open_gym(session, owner.id, args.name)
        if args.what == "limit":
            _limit_gym(session, args)
        for gym in session.scalars(select(Gym).order_by(Gym.slug)):
            line = f"{gym.slug:<30} {gym.visibility:<9} {gym.name}"
            if gym.storage_quota_mb is not None:
                line += f", at most {gym.storage_quota_mb} MB"
            if gym.features_barred:
                line += f", without {' '.join(gym.features_barred)}"
            console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0


def _limit_gym(session: Session, args: argparse.Namespace) -> None:
    from typing import get_args

    from walltopo_gym.cli.gym_data import gym_named
    from walltopo_gym.operating.gyms import limit_gym
    from walltopo_gym.settings import Switch

    gym = gym_named(session, args.name)
    unknown = set(args.off) - set(get_args(Switch))
    if unknown:
        known = ", ".join(get_args(Switch))
        raise InputError(f"unknown feature: {', '.join(sorted(unknown))}", f"Features: {known}.")
    limit_gym(session, gym, args.quota, args.off, None)


def _jobs(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options
    from walltopo_gym.operating.jobs import cancel_scan, job_lines, retry_job, retry_scan

    with database_of_options(args) as database:
        if args.what != "list":
            if args.id is None:
                raise InputError(f"{args.what} which job?", "`walltopo gym jobs` lists them.")
            scan = _scan_id(args.id)
            if scan is None and args.what == "cancel":
                raise InputError("only a scan is cancelled", "`walltopo gym jobs` lists them.")
            if scan is None:
                retry_job(database, args.id)
            else:
                with database.writing() as session:
                    (retry_scan if args.what == "retry" else cancel_scan)(session, scan)
        for line in job_lines(database):
            console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0


def _scan_id(text: str) -> UUID | None:
    """Return the id of a scan; None for that of another job, which begins with a word."""
    try:
        return UUID(text)
    except ValueError:
        return None


def _workers(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options
    from walltopo_gym.jobs.heartbeat import is_alive, list_workers

    with database_of_options(args) as database, database.reading() as session:
        for row in list_workers(session):
            sign = "✓" if is_alive(row) else "✗"
            line = f"{sign} {row.name} {row.version} last seen {row.seen_at:%Y-%m-%d %H:%M:%S} UTC"
            console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0


def _storage(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options, settings_of
    from walltopo_gym.operating.storage_use import disk_use, measure_storage, storage_use
    from walltopo_gym.storage.files import open_store

    settings = settings_of(args)
    with database_of_options(args) as database:
        measure_storage(database, open_store(settings))
        with database.reading() as session:
            use = storage_use(session)
    disk = disk_use(settings)
    console.print(f"{disk.free / 1e6:,.0f} of {disk.total / 1e6:,.0f} MB of the disk are free")
    for row in use.rows:
        line = (
            f"{row.slug or '(no gym)':<30} {row.kind:<10} {row.files:>8} {row.bytes / 1e6:,.1f} MB"
        )
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    if use.more:
        console.print("... and more gyms")
    return 0

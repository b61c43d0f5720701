"""`walltopo gym backup|backups|restore`: make, try and restore backups."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import add_overwrite
from walltopo.core import InputError
from walltopo_gym.cli.options import add_gym_data_options

if TYPE_CHECKING:
    from walltopo_gym.operating.backup_runs import Kind
    from walltopo_gym.settings import GymSettings


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands of backups."""
    backup = inner.add_parser("backup", help="write a backup of a running gym")
    backup.add_argument("file", type=Path, metavar="FILE.tar")
    add_overwrite(backup)
    backup.add_argument(
        "--try",
        dest="with_trial",
        action="store_true",
        help="then restore it into a scratch place and compare it with the gym",
    )
    backup.set_defaults(run=_backup)
    backups = inner.add_parser(
        "backups", help="list the backups at `backup_to`, make one there, or try one again"
    )
    backups.add_argument("what", choices=("list", "make", "try"), nargs="?", default="list")
    backups.add_argument(
        "file", nargs="?", metavar="FILE", help="(try) a file, or a name of the list"
    )
    backups.set_defaults(run=_backups)
    restore = inner.add_parser("restore", help="bring a backup back into an empty place")
    restore.add_argument("file", type=Path, metavar="FILE.tar")
    restore.add_argument(
        "--replace",
        action="store_true",
        help="of a stopped gym, whose data are put aside; gym.toml stays",
    )
    restore.set_defaults(run=_restore)
    for command in (backup, backups, restore):
        add_gym_data_options(command)


def _backup(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import check_there, database_of_options, settings_of
    from walltopo_gym.operating.backup import back_up
    from walltopo_gym.storage.files import open_store

    settings = settings_of(args)
    check_there(settings)
    with database_of_options(args) as database:
        number = back_up(
            settings, database, open_store(settings), args.file, overwrite=args.overwrite
        )
    console.print(f"{args.file}: {number} files", soft_wrap=True, markup=False)
    return _try_backup(settings, args.file) if args.with_trial else 0


def _backups(args: argparse.Namespace) -> int:
    from walltopo_gym.cli.gym_data import check_there, settings_of

    settings = settings_of(args)
    if args.what == "list":
        return _list_backups(settings)
    check_there(settings)
    if args.what == "make":
        return _run_now(args, "make")
    if args.file is None:
        raise InputError("try which backup?", "`walltopo gym backups` lists them; or give a file.")
    if Path(args.file).is_file():
        return _try_backup(settings, Path(args.file))
    return _run_now(args, "try")


def _list_backups(settings: GymSettings) -> int:
    """Print the backups at the target; a gym is not needed."""
    from walltopo.cli.console import console
    from walltopo_gym.operating.backup_target import open_target

    for one in open_target(settings).newest():
        line = (
            f"{one.made_at:%Y-%m-%d %H:%M} UTC {one.size / 1e6:>10,.1f} MB {one.name} {one.summary}"
        )
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0


def _run_now(args: argparse.Namespace, kind: Kind) -> int:
    """Make a backup at the target, or try one there, in this process."""
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of_options, settings_of
    from walltopo_gym.mail import make_mailer
    from walltopo_gym.operating.backup_runs import BackupRuns, run_now
    from walltopo_gym.operating.backup_target import open_target
    from walltopo_gym.storage.files import open_store

    settings = settings_of(args)
    with database_of_options(args) as database:
        runs = BackupRuns(settings, database, open_store(settings), make_mailer(settings))
        name = run_now(runs, kind, args.file or "")
    found = open_target(settings).find(name)
    console.print(f"{name}: {found.summary}", soft_wrap=True, markup=False, highlight=False)
    return 0


def _try_backup(settings: GymSettings, file: Path) -> int:
    """Print the result of a trial; return 1 unless the backup is equal to what it lists."""
    from walltopo.cli.console import console
    from walltopo_gym.operating.backup_trial import try_backup

    trial = try_backup(settings, file)
    for line in (trial.summary, *(f"! {one}" for one in trial.differences)):
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    return 0 if trial.is_equal else 1


def _restore(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import settings_of
    from walltopo_gym.operating.backup import restore
    from walltopo_gym.operating.replacement import replace_data
    from walltopo_gym.storage.files import open_store

    settings = settings_of(args)
    if args.replace:
        former = " and ".join(replace_data(settings, args.file))
        console.print(f"the backup is in place; the former data are in {former}", soft_wrap=True)
        return 0
    number = restore(settings, open_store(settings), args.file)
    console.print(f"{number} files are back; `walltopo gym serve` serves them", soft_wrap=True)
    return 0

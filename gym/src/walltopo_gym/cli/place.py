"""What the operator's commands share: the database, and a password from the keyboard or a pipe."""

from __future__ import annotations

import argparse
import getpass
import sys
from collections.abc import Iterator
from contextlib import contextmanager

from walltopo.core import InputError
from walltopo_gym.database.engine import Database
from walltopo_gym.migrations.run import migrate
from walltopo_gym.settings import GymSettings, load_settings
from walltopo_gym.storage.files import private_folder


def settings_of(args: argparse.Namespace) -> GymSettings:
    """The settings of `--data`, `--database` and `--objects`."""
    return load_settings({name: getattr(args, name) for name in ("data", "database", "objects")})


@contextmanager
def opened(args: argparse.Namespace) -> Iterator[Database]:
    """The database of `--data` and `--database`, with the tables of this version."""
    with database_of(settings_of(args)) as database:
        yield database


@contextmanager
def database_of(settings: GymSettings) -> Iterator[Database]:
    """The database of the settings, with the tables of this version."""
    private_folder(settings.data)
    database = Database(settings.database_url)
    try:
        migrate(database)
        yield database
    finally:
        database.close()


def asked_password() -> str:
    """A password, twice from a keyboard, once from a pipe; never from the command line, which
    other people of the machine can read.

    Raises
    ------
    InputError : the two differ.
    """
    if not sys.stdin.isatty():
        return sys.stdin.readline().rstrip("\n")
    first = getpass.getpass("password: ")
    if getpass.getpass("again: ") != first:
        raise InputError("the two passwords differ")
    return first

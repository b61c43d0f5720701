"""Shared parts of the operator's commands: the database, and a password from keyboard or pipe."""

from __future__ import annotations

import argparse
import getpass
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import UUID

from sqlalchemy import make_url, select
from sqlalchemy.orm import Session

from walltopo.core import InputError
from walltopo_gym.database.engine import Database
from walltopo_gym.features import open_database
from walltopo_gym.gyms.models import Gym
from walltopo_gym.migrations.run import migrate
from walltopo_gym.operating.replacement import finish_switch
from walltopo_gym.settings import GymSettings, load_settings
from walltopo_gym.storage.files import private_folder


def settings_of(args: argparse.Namespace) -> GymSettings:
    """Return the settings of `--data`, `--database` and `--objects`; end a replacement of the data
    that a kill interrupted."""
    names = ("data", "database", "objects")
    settings = load_settings({name: getattr(args, name) for name in names})
    finish_switch(settings)
    return settings


def check_there(settings: GymSettings) -> None:
    """Refuse a data folder without a gym, because a misspelt name would create a new one.

    Raises
    ------
    InputError : the settings' database file does not exist.
    """
    url = make_url(settings.database_url)
    if url.get_backend_name() == "sqlite" and url.database and not Path(url.database).is_file():
        raise InputError(f"{settings.data}: no gym there", "Give the folder of one by --data.")


def gym_named(session: Session, slug: str) -> UUID:
    """Return the id of a gym by its name in addresses.

    Raises
    ------
    InputError : there is no such gym.
    """
    found = session.scalar(select(Gym.id).where(Gym.slug == slug))
    if found is None:
        raise InputError(f"there is no gym {slug!r}", "`walltopo gym gym list` lists them.")
    return found


@contextmanager
def database_of_options(args: argparse.Namespace) -> Iterator[Database]:
    """Return the database of `--data` and `--database`, with the tables of this version."""
    with database_of(settings_of(args)) as database:
        yield database


@contextmanager
def database_of(settings: GymSettings) -> Iterator[Database]:
    """Return the database of the settings, with the tables of this version."""
    private_folder(settings.data)
    database = open_database(settings)
    try:
        migrate(database)
        yield database
    finally:
        database.close()


def read_password() -> str:
    """Read a password, twice from a keyboard or once from a pipe. The command line is visible to
    other users of the machine.

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

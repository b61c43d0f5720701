"""`walltopo gym user`: find accounts and change them, by the functions of the operator's page."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Final

from walltopo.core import InputError
from walltopo_gym.cli.options import add_gym_data_options

if TYPE_CHECKING:
    from sqlalchemy.orm import Session

    from walltopo_gym.accounts.models import Person
    from walltopo_gym.accounts.notices import Change
    from walltopo_gym.database.engine import Database
    from walltopo_gym.settings import GymSettings

_ACTIONS: Final = (
    "add",
    "find",
    "password",
    "lock",
    "unlock",
    "sign-out",
    "no-second-factor",
    "export",
    "delete",
)
_MAX: Final = 200  # accounts that `find` lists


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command for accounts."""
    user = inner.add_parser("user", help="make, find, lock, sign out, export or delete accounts")
    user.add_argument("what", choices=_ACTIONS)
    user.add_argument("email", help="of the account; (find) part of the name or of the address")
    user.add_argument("--name", help="(add) as others see it; default: what stands before the @")
    user.add_argument("--operator", action="store_true", help="(add) may administer the server")
    add_gym_data_options(user)
    user.set_defaults(run=_user)


def _user(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.accounts.people import normalise_email
    from walltopo_gym.cli.gym_data import database_of_options, settings_of

    with database_of_options(args) as database:
        if args.what == "find":
            return _find_users(database, args.email)
        email = normalise_email(args.email)
        if args.what == "export":
            return _export_user(settings_of(args), database, email)
        if args.what in ("add", "password"):
            _set_password(database, args, email)
        else:
            _change_user(settings_of(args), database, args.what, email)
    console.print(f"{email}: done", soft_wrap=True)
    return 0


def _find_users(database: Database, text: str) -> int:
    from walltopo.cli.console import console
    from walltopo_gym.accounts.models import Person
    from walltopo_gym.operating.users import users_named

    with database.reading() as session:
        wanted = users_named(text.strip()).order_by(Person.email).limit(_MAX + 1)
        rows = session.scalars(wanted).all()
    for row in rows[:_MAX]:
        marks = " operator" * row.operator + " locked" * (row.locked_at is not None)
        line = f"{row.email:<40} {row.created_at:%Y-%m-%d} {row.name}{marks}"
        console.print(line, soft_wrap=True, markup=False, highlight=False)
    if len(rows) > _MAX:
        console.print("... and more")
    return 0


def _set_password(database: Database, args: argparse.Namespace, email: str) -> None:
    """Make an account, or give one another password."""
    from walltopo_gym.accounts.passwords import Passwords, check_password
    from walltopo_gym.accounts.people import add_person, set_password
    from walltopo_gym.cli.gym_data import read_password

    name = args.name or email.partition("@")[0]
    if args.what == "password":
        with database.reading() as session:
            name = _account_by_email(session, email).name
    password = read_password()  # before a transaction: it waits for the keyboard
    check_password(password, email, name)
    kept = Passwords().hash(password)
    with database.writing() as session:
        if args.what == "add":
            add_person(session, email, name, kept, operator=args.operator)
        else:
            set_password(session, _account_by_email(session, email), kept)


def _change_user(settings: GymSettings, database: Database, what: str, email: str) -> None:
    """Do what the operator's page does with an account, and mail its owner."""
    from walltopo_gym.accounts.notices import notice
    from walltopo_gym.mail import make_mailer
    from walltopo_gym.operating import users

    changes: dict[str, tuple[Callable[[Session, Person], object], Change]] = {
        "lock": (lambda s, p: users.lock_user(s, p.id, None), "account-locked"),
        "unlock": (lambda s, p: users.unlock_user(s, p.id, None), "account-unlocked"),
        "sign-out": (lambda s, p: users.sign_out_user(s, p.id, None), "signed-out"),
        "no-second-factor": (
            lambda s, p: users.reset_second_factor(s, p.id, None),
            "second-factor-reset",
        ),
        "delete": (lambda s, p: users.delete_user(s, p.id, email, None), "account-deleted"),
    }
    change, mail = changes[what]
    with database.writing() as session:
        change(session, _account_by_email(session, email))
    make_mailer(settings).send(notice(settings, email, mail, "en"))


def _export_user(settings: GymSettings, database: Database, email: str) -> int:
    """Print all data of an account as JSON, and mail its owner."""
    import sys

    from fastapi.encoders import jsonable_encoder
    from msgspec import json

    from walltopo_gym.accounts.notices import notice
    from walltopo_gym.mail import make_mailer
    from walltopo_gym.operating.users import export_user

    with database.writing() as session:
        data = export_user(session, _account_by_email(session, email).id, None)
    sys.stdout.write(json.format(json.encode(jsonable_encoder(data))).decode() + "\n")
    make_mailer(settings).send(notice(settings, email, "data-exported", "en"))
    return 0


def _account_by_email(session: Session, email: str) -> Person:
    from walltopo_gym.accounts.people import find_person

    person = find_person(session, email)
    if person is None:
        raise InputError(f"{email}: no account", "`walltopo gym user find` lists them.")
    return person

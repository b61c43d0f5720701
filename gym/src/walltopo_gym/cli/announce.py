"""`walltopo gym announce`: texts that the app shows to everybody."""

from __future__ import annotations

import argparse
from datetime import UTC, datetime
from uuid import UUID

from walltopo.core import InputError
from walltopo_gym.cli.options import add_gym_data_options
from walltopo_gym.languages import LANGUAGES


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command for announcements."""
    announce = inner.add_parser("announce", help="show a text to everybody on top of the app")
    announce.add_argument("what", choices=("list", "add", "delete"))
    announce.add_argument("id", nargs="?", type=UUID, help="(delete) of the announcement")
    for language in LANGUAGES:
        announce.add_argument(f"--{language}", metavar="TEXT", help=f"(add) the text in {language}")
    announce.add_argument("--from", dest="starts", metavar="TIME", help="(add) default: now")
    announce.add_argument("--until", metavar="TIME", help="(add) such as 2026-12-24T18:00 (UTC)")
    add_gym_data_options(announce)
    announce.set_defaults(run=_announce)


def _announce(args: argparse.Namespace) -> int:
    from sqlalchemy import select

    from walltopo.cli.console import console
    from walltopo_gym.announcements.models import Announcement
    from walltopo_gym.announcements.service import drop_announcement, make_announcement
    from walltopo_gym.cli.gym_data import database_of_options

    with database_of_options(args) as database, database.writing() as session:
        if args.what == "add":
            texts = {each: getattr(args, each) for each in LANGUAGES if getattr(args, each)}
            make_announcement(
                session, texts, _parse_time(args.starts), _parse_time(args.until), None
            )
        elif args.what == "delete":
            if args.id is None:
                raise InputError("delete which one?", "`walltopo gym announce list` lists them.")
            drop_announcement(session, args.id, None)
        rows = select(Announcement).order_by(Announcement.starts_at.desc()).limit(200)
        for row in session.scalars(rows):
            until = "" if row.ends_at is None else f" until {row.ends_at:%Y-%m-%d %H:%M}"
            line = f"{row.id} from {row.starts_at:%Y-%m-%d %H:%M}{until}"
            for text in (line, *(f"    {name}: {text}" for name, text in row.texts.items())):
                console.print(text, soft_wrap=True, markup=False, highlight=False)
    return 0


def _parse_time(text: str | None) -> datetime | None:
    """Return a time of the command line; UTC without a zone.

    Raises
    ------
    InputError : it is not a time.
    """
    if text is None:
        return None
    try:
        found = datetime.fromisoformat(text)
    except ValueError as error:
        raise InputError(f"{text}: not a time", "Give one such as 2026-12-24T18:00.") from error
    return found if found.tzinfo is not None else found.replace(tzinfo=UTC)

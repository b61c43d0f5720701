"""Options that several commands share. Every `walltopo` imports this module: keep it light."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from functools import wraps
from pathlib import Path


def add_gym_data_options(parser: argparse.ArgumentParser) -> None:
    """Add the options that locate the gym."""
    parser.add_argument("--data", type=Path, metavar="DIR", help="the folder of everything")
    parser.add_argument("--database", metavar="URL", help="PostgreSQL instead of SQLite in DIR")
    parser.add_argument("--objects", metavar="URL", help="an S3 bucket instead of files in DIR")


def in_words(run: Callable[[argparse.Namespace], int]) -> Callable[[argparse.Namespace], int]:
    """Return a command that says in words what its database, file store or disk lacks."""

    @wraps(run)
    def run_it(args: argparse.Namespace) -> int:
        try:
            return run(args)
        except Exception as error:
            from walltopo_gym.database.errors import explain_error

            found = explain_error(error)
            if found is None:
                raise
            raise found from error

    return run_it


def print_help(parser: argparse.ArgumentParser) -> int:
    """Print the help of a command that lacks its subcommand; exit code 2."""
    parser.print_help()
    return 2

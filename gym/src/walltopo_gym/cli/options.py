"""Options that several commands share. Every `walltopo` imports this module: keep it light."""

from __future__ import annotations

import argparse
from pathlib import Path


def add_place(parser: argparse.ArgumentParser) -> None:
    """Add the options that locate the gym."""
    parser.add_argument("--data", type=Path, metavar="DIR", help="the folder of everything")
    parser.add_argument("--database", metavar="URL", help="PostgreSQL instead of SQLite in DIR")
    parser.add_argument("--objects", metavar="URL", help="an S3 bucket instead of files in DIR")

"""Where a command writes: `--overwrite`, and what no command may write into."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

from walltopo.core import InputError
from walltopo.core.outputs import Target


def add_overwrite(parser: argparse.ArgumentParser, *other_names: str) -> None:
    """`--overwrite`, for commands that write a file or folder of the user's choice."""
    parser.add_argument(
        "--overwrite",
        *other_names,
        action="store_true",
        help="replace files that are there already and that this command did not write",
    )


def target(
    args: argparse.Namespace,
    path: Path,
    command: str,
    *,
    flag: str = "-o",
    inputs: Sequence[Path | None] = (),
) -> Target:
    """The place of a result; see `walltopo.core.outputs`.

    Parameters
    ----------
    args : of a parser with `add_overwrite`.
    command : the words of the command, without what can vary between two runs of it.
    inputs : what the command reads, apart from scan folders, which are safe in any case.
    """
    given = [path for path in inputs if path is not None]
    return Target(path, flag, command, args.overwrite, given, _refuse_scan)


def _refuse_scan(place: Path) -> None:
    from walltopo.scans.folder import owning_scan

    scan = owning_scan(place)
    if scan is not None:
        raise InputError(
            f"{place}: belongs to the scan {scan.root}",
            "Only `walltopo scan` writes there: give another place, or another name.",
        )

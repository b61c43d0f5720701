"""`walltopo batch`: run many scans from one list."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number

if TYPE_CHECKING:
    from walltopo.pipeline.batch.job import Outcome, ScanJob


_EPILOG = """\
the list is a text of lines `PHOTOS SCAN`, a CSV with the columns photos, out, and optionally
reference, config, settings, or a TOML of [[scan]] tables with these keys. Paths are relative to
the folder of the list; photos and out may be S3 URLs (needs walltopo[s3]).

examples:
  walltopo batch walls.csv                 as many at a time as this machine can run
  walltopo batch walls.toml --jobs 4 --json
  walltopo batch walls.csv --ray auto      on the Ray cluster of this machine

Run the same command again after a failure or Ctrl-C: finished work is kept. Each scan's log is
scan.log in its folder. Exit code 0 if all scans are done, else 1.
"""

_GB = 1 << 30
_MARKS = {"done": "green", "up to date": "dim", "failed": "red", "lost": "red"}


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    batch = commands.add_parser(
        "batch",
        help="run many scans from one list",
        description="Run every scan of a list; a failed scan does not stop the others.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    batch.add_argument("list", type=Path, metavar="LIST", help="the list of photos and scans")
    batch.add_argument(
        "-j",
        "--jobs",
        type=Number(int, 1, 1024),
        metavar="N",
        help="number of parallel scans on this machine",
    )
    batch.add_argument("--config", type=Path, metavar="FILE", help="settings file of all scans")
    batch.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="setting of all scans"
    )
    batch.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="run each scan as a task of this Ray cluster: auto, local, address",
    )
    batch.add_argument(
        "--cores",
        type=Number(int, 1, 1024),
        metavar="N",
        help="cores per scan (default with --ray: 2, else as the libraries choose)",
    )
    batch.add_argument(
        "--memory",
        type=Number(float, 0.1, 4096),
        default=4.0,
        metavar="GB",
        help="memory per scan that --ray reserves (default: 4)",
    )
    batch.add_argument("--json", action="store_true", help="print the result as JSON on stdout")
    batch.add_argument("-q", "--quiet", action="store_true", help="errors only")
    batch.set_defaults(run=_batch)


def _batch(args: argparse.Namespace) -> int:
    import msgspec

    from walltopo.cli.console import console, error_console
    from walltopo.core import SettingsError
    from walltopo.pipeline.batch.job import settings_of_job
    from walltopo.pipeline.batch.job_list import read_list

    if args.ray is not None and args.jobs is not None:
        raise SettingsError("--jobs is for this machine", "With --ray, use --cores and --memory.")
    jobs = [_with_common(job, args) for job in read_list(args.list)]
    for job in jobs:
        settings_of_job(job)  # find invalid settings before the first scan starts
    outcomes: list[Outcome] = []
    for outcome in _run(jobs, args):
        outcomes.append(outcome)
        if not args.quiet and not args.json:
            console.print(
                f"{len(outcomes)}/{len(jobs)} {outcome.out}: {outcome.state}", soft_wrap=True
            )
    order = {job.out: index for index, job in enumerate(jobs)}
    outcomes.sort(key=lambda outcome: order[outcome.out])
    if args.json:
        console.print(msgspec.json.encode(outcomes).decode(), soft_wrap=True)
    elif not args.quiet:
        _show(outcomes)
    bad = [outcome for outcome in outcomes if not outcome.is_finished]
    for outcome in bad:
        message = outcome.error.removeprefix(f"{outcome.out}: ")
        error_console.print(f"{outcome.out}: {message}", soft_wrap=True, style="red")
        if outcome.hint:
            error_console.print(outcome.hint, soft_wrap=True, style="dim")
    return 1 if bad else 0


def _with_common(job: ScanJob, args: argparse.Namespace) -> ScanJob:
    from msgspec.structs import replace

    config = job.config or (str(args.config.absolute()) if args.config else "")
    return replace(job, config=config, settings=(*args.set, *job.settings))


def _run(jobs: Sequence[ScanJob], args: argparse.Namespace) -> Iterator[Outcome]:
    from walltopo.pipeline.batch.run import (
        default_parallel_scans,
        on_cluster,
        run_here,
        run_on_cluster,
    )

    with ExitStack() as stack:
        if args.ray is None:
            yield from run_here(jobs, args.jobs or default_parallel_scans(), args.cores or 0)
            return
        stack.enter_context(on_cluster(args.ray))
        yield from run_on_cluster(jobs, args.cores or 2, int(args.memory * _GB))


def _show(outcomes: Sequence[Outcome]) -> None:
    """Print a line per scan, and the number of scans that are done."""
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.cli.listener import duration

    table = Table()
    table.add_column("scan", overflow="fold")
    table.add_column("state")
    for column in ("photos", "holds", "routes", "time", "tries"):
        table.add_column(column, justify="right")
    for one in outcomes:
        counts = [str(n) if one.is_finished else "" for n in (one.photos, one.holds, one.routes)]
        style = _MARKS[one.state]
        table.add_row(
            one.out, one.state, *counts, duration(one.seconds), str(one.tries), style=style
        )
    console.print(table)
    well = sum(outcome.is_finished for outcome in outcomes)
    console.print(f"{well} of {len(outcomes)} scans are done")

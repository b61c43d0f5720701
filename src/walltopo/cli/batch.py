"""`walltopo batch`: many scans from one list."""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number

if TYPE_CHECKING:
    from walltopo.pipeline.batch.job import Job, Outcome


_EPILOG = """\
the list is a text of lines `PHOTOS SCAN`, a CSV with the columns photos, out, and perhaps
reference, config, settings, or a TOML of [[scan]] tables with these keys. Paths are meant from
the folder of the list; photos and out may be URLs of S3 (needs walltopo[s3]).

examples:
  walltopo batch walls.csv                 as many at a time as this machine has room for
  walltopo batch walls.toml --jobs 4 --json
  walltopo batch walls.csv --ray auto      on the Ray cluster of this machine

Run the same command again after a failure or Ctrl-C: what is done is kept. Each scan's log is
scan.log in its folder. Exit code 0 when all are done, 1 when one is not.
"""

_GB = 1 << 30
_MARKS = {"done": "green", "up to date": "dim", "failed": "red", "lost": "red"}


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    batch = commands.add_parser(
        "batch",
        help="many scans from one list",
        description="Run every scan of a list; one that fails does not end the others.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    batch.add_argument("list", type=Path, metavar="LIST", help="which photos become which scans")
    batch.add_argument(
        "-j",
        "--jobs",
        type=Number(int, 1, 1024),
        metavar="N",
        help="scans at a time, on this machine",
    )
    batch.add_argument("--config", type=Path, metavar="FILE", help="settings of scans without own")
    batch.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="for all, below their own"
    )
    batch.add_argument(
        "--ray",
        metavar="ADDRESS",
        help="each scan a task of this Ray cluster: auto, local, address",
    )
    batch.add_argument(
        "--cores",
        type=Number(int, 1, 1024),
        metavar="N",
        help="cores of one scan (with --ray 2 by default, else as its libraries like)",
    )
    batch.add_argument(
        "--memory",
        type=Number(float, 0.1, 4096),
        default=4.0,
        metavar="GB",
        help="memory of one scan that --ray reckons with (4)",
    )
    batch.add_argument("--json", action="store_true", help="the result as JSON on stdout")
    batch.add_argument("-q", "--quiet", action="store_true", help="errors only")
    batch.set_defaults(run=_batch)


def _batch(args: argparse.Namespace) -> int:
    import msgspec

    from walltopo.cli.console import console, error_console
    from walltopo.core import SettingsError
    from walltopo.pipeline.batch.job import settings_of_job
    from walltopo.pipeline.batch.listed import read_list

    if args.ray is not None and args.jobs is not None:
        raise SettingsError("--jobs is for this machine", "With --ray, say --cores and --memory.")
    jobs = [_with_common(job, args) for job in read_list(args.list)]
    for job in jobs:
        settings_of_job(job)  # before the first begins
    outcomes: list[Outcome] = []
    for outcome in _run(jobs, args):
        outcomes.append(outcome)
        if not args.quiet and not args.json:
            console.print(
                f"{len(outcomes)}/{len(jobs)} {outcome.out}: {outcome.state}", soft_wrap=True
            )
    order = {job.out: place for place, job in enumerate(jobs)}
    outcomes.sort(key=lambda outcome: order[outcome.out])
    if args.json:
        console.print(msgspec.json.encode(outcomes).decode(), soft_wrap=True)
    elif not args.quiet:
        _show(outcomes)
    bad = [outcome for outcome in outcomes if not outcome.well]
    for outcome in bad:
        told = outcome.error.removeprefix(f"{outcome.out}: ")
        error_console.print(f"{outcome.out}: {told}", soft_wrap=True, style="red")
        if outcome.hint:
            error_console.print(outcome.hint, soft_wrap=True, style="dim")
    return 1 if bad else 0


def _with_common(job: Job, args: argparse.Namespace) -> Job:
    from msgspec.structs import replace

    config = job.config or (str(args.config.absolute()) if args.config else "")
    return replace(job, config=config, settings=(*args.set, *job.settings))


def _run(jobs: Sequence[Job], args: argparse.Namespace) -> Iterator[Outcome]:
    from walltopo.pipeline.batch.ray_cluster import on_cluster
    from walltopo.pipeline.batch.run import jobs_for_here, run_here, run_on_cluster

    with ExitStack() as stack:
        if args.ray is None:
            yield from run_here(jobs, args.jobs or jobs_for_here(), args.cores or 0)
            return
        stack.enter_context(on_cluster(args.ray))
        yield from run_on_cluster(jobs, args.cores or 2, int(args.memory * _GB))


def _show(outcomes: Sequence[Outcome]) -> None:
    """A line a scan, and how many are well."""
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.cli.listener import duration

    table = Table()
    table.add_column("scan", overflow="fold")
    table.add_column("state")
    for column in ("photos", "holds", "routes", "time", "tries"):
        table.add_column(column, justify="right")
    for one in outcomes:
        counts = [str(n) if one.well else "" for n in (one.photos, one.holds, one.routes)]
        style = _MARKS[one.state]
        table.add_row(
            one.out, one.state, *counts, duration(one.seconds), str(one.tries), style=style
        )
    console.print(table)
    well = sum(outcome.well for outcome in outcomes)
    console.print(f"{well} of {len(outcomes)} scans are done")

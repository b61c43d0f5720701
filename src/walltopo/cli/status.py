"""`walltopo status`: print the state of a scan, one line per stage."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.core import InputError

if TYPE_CHECKING:
    from walltopo.pipeline.health import StageHealth


GAP = 2  # columns between two cells


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    status = commands.add_parser(
        "status",
        help="show the state of a scan and its stages",
        description="Print a line per stage: its state, time, memory and figures that fit. "
        "Exit code 0 if all stages are done, 1 if some would run again.",
    )
    status.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    status.add_argument("--verify", action="store_true", help="read every file to find damage")
    status.add_argument("-v", "--verbose", action="store_true", help="all figures of each stage")
    status.set_defaults(run=_status)


def _status(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.pipeline.health import stages_health
    from walltopo.scans.folder import ScanFolder

    folder = ScanFolder(args.scan)
    if not folder.manifest.is_file():
        raise InputError(f"{args.scan}: not a scan folder (it has no scan.json)")
    stages = stages_health(folder, verify=args.verify)
    _show(stages, args.verbose)
    due = [found.stage for found in stages if found.state not in ("done", "running")]
    if due:
        stages_due = f"{len(due)} of {len(stages)} stages"
        console.print(f"{stages_due} would run now: walltopo scan -o {args.scan}", soft_wrap=True)
    return 0 if all(found.state == "done" for found in stages) else 1


def _show(stages: list[StageHealth], verbose: bool) -> None:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.cli.listener import describe_metrics, duration

    rows = []
    for found in stages:
        record = found.record
        time = duration(record.seconds) if record else ""
        memory = f"{record.peak_mb:,.0f} MB" if record else ""
        rows.append((found.stage, found.state, time, memory))
    names = ("stage", "state", "time", "memory")
    widths = [max(map(len, column)) for column in zip(names, *rows, strict=True)]
    left = console.width - sum(widths) - GAP * len(widths)
    table = Table(box=None, pad_edge=False, padding=(0, GAP, 0, 0))
    for name, width in zip(names, widths, strict=True):
        justify = "right" if name in ("time", "memory") else "left"
        table.add_column(name, justify=justify, min_width=width, no_wrap=True)  # type: ignore[arg-type]
    table.add_column("figures", overflow="fold")
    for found, row in zip(stages, rows, strict=True):
        facts = found.why
        if found.record and not facts:
            facts = describe_metrics(found.record.metrics, None if verbose else left)
        table.add_row(*row, facts)
    console.print(table)

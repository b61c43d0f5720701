"""`walltopo doctor`: what this machine can do."""

from __future__ import annotations

import argparse
from pathlib import Path

__all__ = ["register"]


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add this group's command."""
    doctor = commands.add_parser(
        "doctor",
        help="what this machine can do: CUDA, OpenMVS, ffmpeg, models, memory, disk",
        description="Exit code 0 when a scan can run here, 5 when something needed is missing.",
    )
    doctor.set_defaults(run=_doctor)


def _doctor(args: argparse.Namespace) -> int:
    from rich.table import Table
    from rich.text import Text

    from walltopo.cli.console import console
    from walltopo.doctor import examine

    marks = {
        "ok": Text("ok", "green"),
        "missing": Text("not here", "yellow"),
        "problem": Text("problem", "red"),
    }
    table = Table(show_header=False, box=None, pad_edge=False)
    problems = 0
    for finding in examine(Path.cwd()):
        table.add_row(finding.topic, marks[finding.state], finding.detail)
        problems += finding.state == "problem"
    console.print(table)
    return 5 if problems else 0

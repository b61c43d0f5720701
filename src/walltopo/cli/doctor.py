"""`walltopo doctor`: print what works on this machine."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from walltopo.cli.diagnosis import Finding


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add this group's command."""
    doctor = commands.add_parser(
        "doctor",
        help="check what works on this machine, and how to install what is missing",
        description="Exit code 0 if a scan can run here, 5 if something needed is missing.",
    )
    doctor.add_argument("--json", action="store_true", help="print JSON")
    doctor.set_defaults(run=_doctor)


def _doctor(args: argparse.Namespace) -> int:
    from walltopo.cli.diagnosis import examine

    findings = tuple(examine(Path.cwd()))
    ready = all(finding.state != "problem" for finding in findings)
    (_as_json if args.json else _as_table)(findings, ready)
    return 0 if ready else 5


def _as_json(findings: Sequence[Finding], ready: bool) -> None:
    import dataclasses
    import json
    import sys

    rows = [dataclasses.asdict(finding) for finding in findings]
    json.dump({"version": 1, "ready": ready, "findings": rows}, sys.stdout, indent=1)
    sys.stdout.write("\n")


def _as_table(findings: Sequence[Finding], ready: bool) -> None:
    from rich.table import Table
    from rich.text import Text

    from walltopo.cli.console import console

    marks = {
        "ok": Text("ok", "green"),
        "missing": Text("missing", "yellow"),
        "problem": Text("problem", "red"),
    }
    table = Table(show_header=False, box=None, pad_edge=False)
    for finding in findings:
        shown = Text(finding.detail)
        if finding.install:
            shown.append(f"\n{finding.install}", "bold")
        table.add_row(finding.topic, marks[finding.state], shown)
    console.print(table)
    console.print("A scan can run here." if ready else "A scan cannot run well here.")

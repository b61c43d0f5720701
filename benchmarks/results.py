"""Records of measurements in `docs/results/*.json`: one command's output, data and date."""

from __future__ import annotations

import datetime
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec

import walltopo
from walltopo.scans.document import Document

RESULTS = Path("docs/results")


class Measured(msgspec.Struct, frozen=True):
    """The date, version and commit of a measurement ("+": with uncommitted changes)."""

    date: str
    version: str
    revision: str


class Record(Document, frozen=True, kw_only=True):
    """The output of one command.

    Parameters
    ----------
    command : as typed at the root of the repository; words in capitals stand for folders.
    on : the data, in words.
    evaluator : source of the protocol; "" if the figures are no scores.
    classes : "merged into one", "mean of classes", "each by itself"; "" without classes.
    measured : None before the first run.
    transcribed : the output is a copy from a page at that revision, whose author ran the command;
        `record` has not run it since.
    output : lines of the output.
    """

    command: str
    on: str
    evaluator: str = ""
    classes: str = ""
    measured: Measured | None = None
    transcribed: bool = False
    output: tuple[str, ...] = ()


class Part(Document, frozen=True, kw_only=True):
    """The figures of one table of `docs/results.md`, written by `benchmarks.tables`.

    Parameters
    ----------
    measured, transcribed : see `Record`.
    note : further information for readers, in the page's words.
    figures : in the format of the table's own code.
    took : seconds and cpu_seconds; setup : inputs of the figures besides code.
    """

    measured: Measured
    transcribed: bool = False
    note: str = ""
    figures: dict[str, Any]
    took: dict[str, float]
    setup: dict[str, Any]


def measured_now(root: Path = Path()) -> Measured:
    """Return today, this version, and the commit of the checkout at `root`."""
    describe = ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--abbrev=7"]
    found = subprocess.run(describe, capture_output=True, text=True, check=False)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return Measured(today, walltopo.__version__, found.stdout.strip() or "unknown")


def lines_of(path: Path) -> list[str]:
    """Return a record's lines; for a `Part`, one line per figure with its path: `a/b/c: 0.5`."""
    if not path.name.startswith("tables-"):
        return list(Record.load(path).output)
    return list(_leaves("", Part.load(path).figures))


def _leaves(place: str, value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _leaves(f"{place}/{name}" if place else name, inner)
    else:
        yield f"{place}: {value}"


def tables(record: Record) -> list[list[str]]:
    """Return the Markdown tables among the output's lines."""
    found: list[list[str]] = []
    inside = False
    for line in record.output:
        row = line.startswith("|")
        if row and not inside:
            found.append([])
        if row:
            found[-1].append(line)
        inside = row
    return found

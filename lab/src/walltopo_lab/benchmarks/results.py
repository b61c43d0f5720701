"""Records of measurements: `docs/results/*.json`, each what one command printed, when and on what."""

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
    """When, and by which version and commit ("+": with changes that were not committed)."""

    date: str
    version: str
    revision: str


class Record(Document, frozen=True, kw_only=True):
    """What one command printed.

    Parameters
    ----------
    command : as typed at the root of the repository; words in capitals stand for folders.
    on : the data, in words.
    evaluator : whose protocol; "" where the figures are no scores.
    classes : "merged into one", "mean of classes", "each by itself"; "" where there are none.
    measured : None before the first run.
    transcribed : the output was copied from a page as it stood at that revision, whose author had
        run the command; `record` has not run it since.
    output : its lines.
    """

    command: str
    on: str
    evaluator: str = ""
    classes: str = ""
    measured: Measured | None = None
    transcribed: bool = False
    output: tuple[str, ...] = ()


class Part(Document, frozen=True, kw_only=True):
    """Figures of one table of `docs/results.md`, which `walltopo_lab.benchmarks.tables` writes.

    Parameters
    ----------
    measured, transcribed : see `Record`.
    note : what else a reader should know, in the page's words.
    figures : as the table's own code makes and reads them.
    took : seconds and cpu_seconds; setup : what the figures depend on besides code.
    """

    measured: Measured
    transcribed: bool = False
    note: str = ""
    figures: dict[str, Any]
    took: dict[str, float]
    setup: dict[str, Any]


def measured_now(root: Path = Path()) -> Measured:
    """Today, this version, and the commit of the checkout at `root`."""
    asked = ["git", "-C", str(root), "describe", "--always", "--dirty=+", "--abbrev=7"]
    found = subprocess.run(asked, capture_output=True, text=True, check=False)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return Measured(today, walltopo.__version__, found.stdout.strip() or "unknown")


def lines_of(path: Path) -> list[str]:
    """What a record says, line by line; of a `Part` each figure by its place: `a/b/c: 0.5`."""
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
    """The Markdown tables among the output's lines."""
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

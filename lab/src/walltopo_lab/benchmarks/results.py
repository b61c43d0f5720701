"""Records of measurements: `docs/results/*.json`, each what one command printed, when and on what."""

from __future__ import annotations

from pathlib import Path

import msgspec

from walltopo.scans.document import Document

__all__ = ["RESULTS", "Measured", "Record", "tables"]

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

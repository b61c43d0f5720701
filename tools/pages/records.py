"""Records of measurements: `docs/results/NAME.json` has one command's output, data and date.

    python -m tools.pages.records NAME ... [--with KEY=VALUE ...]

runs the command of a record again and stores its output. Words of the command in capitals (DATA,
SCAN, ...) are placeholders for the values of `--with`. The record and the stored output keep the
placeholders, so a record names no folder of a machine. To begin a new record, write the file by
hand with an empty "output". `tools.pages.figures` writes the pages.
"""

from __future__ import annotations

import argparse
import datetime
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from itertools import groupby
from pathlib import Path

import msgspec
from rich.console import Console

import walltopo
from walltopo.core import InputError
from walltopo.scans.document import Document

RESULTS = Path("docs/results")

console = Console()


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
        this module has not run it since.
    code : files and folders whose changes may change the figures (see `tools.pages.outdated`).
    output : lines of the output.
    """

    command: str
    on: str
    evaluator: str = ""
    classes: str = ""
    measured: Measured | None = None
    transcribed: bool = False
    code: tuple[str, ...] = ()
    output: tuple[str, ...] = ()

    def tables(self) -> list[list[str]]:
        """Return the Markdown tables among the output's lines."""
        runs = groupby(self.output, key=lambda line: line.startswith("|"))
        return [list(lines) for is_table, lines in runs if is_table]


def measured_now() -> Measured:
    """Return today, this version, and the commit of the checkout."""
    describe = ["git", "describe", "--always", "--dirty=+", "--abbrev=7"]
    found = subprocess.run(describe, capture_output=True, text=True, check=False)
    today = datetime.datetime.now(datetime.UTC).date().isoformat()
    return Measured(today, walltopo.__version__, found.stdout.strip() or "unknown")


def filled(command: str, given: Mapping[str, str]) -> list[str]:
    """Return the words of a command with this machine's folders.

    Raises
    ------
    InputError : a word in capitals has no value, or a value has no such word.
    """
    words = shlex.split(command)
    # In DATA/gym-a, the first part of the path is a placeholder.
    heads = {word.split("/")[0] for word in words}
    wanted = {head for head in heads if head.isupper() and head.isalpha()}
    if wanted != set(given):
        raise InputError(
            f"the command wants {', '.join(sorted(wanted)) or 'nothing'}, "
            f"got {', '.join(sorted(given)) or 'nothing'}: {command}",
            "Give each as --with WORD=VALUE.",
        )
    for place, word in enumerate(words):
        head, slash, rest = word.partition("/")
        words[place] = given.get(head, head) + slash + rest
    return [sys.executable, *words[1:]] if words[0] == "python" else words


def unplaced(output: str, given: Mapping[str, str]) -> str:
    """Return an output with this machine's folders replaced by the words in capitals."""
    # Replace the longest first, because one folder may lie in another.
    for word, folder in sorted(given.items(), key=lambda item: -len(item[1])):
        output = output.replace(folder, word)
    return output


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("names", nargs="+", metavar="NAME")
    parser.add_argument("--with", dest="given", nargs="*", default=[], metavar="KEY=VALUE")
    parser.add_argument("--folder", type=Path, default=RESULTS)
    args = parser.parse_args(arguments)
    given = dict(word.split("=", 1) for word in args.given)
    for name in args.names:
        path = args.folder / f"{name}.json"
        record = Record.load(path)
        measured = measured_now()
        done = subprocess.run(filled(record.command, given), stdout=subprocess.PIPE, text=True)
        if done.returncode:
            console.print(f"{name}: the command failed, the record stays", style="red")
            return done.returncode
        output = tuple(line.rstrip() for line in unplaced(done.stdout, given).strip().splitlines())
        msgspec.structs.replace(record, measured=measured, transcribed=False, output=output).save(
            path
        )
        console.print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

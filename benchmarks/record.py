"""Run a benchmark and store its output as the record behind the pages' figures.

    python -m benchmarks.record NAME [--with KEY=VALUE ...]

NAME is a file `docs/results/NAME.json` without its suffix; it contains the command. Words of the
command in capitals (DATA, SCAN, ...) are placeholders for the values of `--with`. The record and
the stored output keep the placeholders, so a record names no folder of a machine. To begin a new
record, write the file by hand with an empty "output". `benchmarks.figures` writes the
pages.
"""

from __future__ import annotations

import argparse
import shlex
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path

from msgspec.structs import replace
from rich.console import Console

from benchmarks.results import RESULTS, Record, measured_now
from walltopo.core import InputError

console = Console()


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
        replace(record, measured=measured, transcribed=False, output=output).save(path)
        console.print(f"wrote {path}")
    return 0


if __name__ == "__main__":
    sys.exit(main())

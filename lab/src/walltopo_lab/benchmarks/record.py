"""Run a benchmark and keep what it printed, as the record that the pages' figures come from.

    python -m walltopo_lab.benchmarks.record NAME [--with KEY=VALUE ...]

NAME is a file `docs/results/NAME.json` without its ending; it holds the command. Words of the
command in capitals (DATA, SCAN, ...) are replaced by what `--with` gives for them, and stand in
the record and in what was printed: a record names no folder of a machine. A new record is begun by
writing the file by hand, with an empty "output". `walltopo_lab.benchmarks.figures` writes the pages.
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

from walltopo.core import InputError
from walltopo_lab.benchmarks.results import RESULTS, Record, measured_now

console = Console()


def filled(command: str, given: Mapping[str, str]) -> list[str]:
    """The words of a command as this machine runs it.

    Raises
    ------
    InputError : a word in capitals was not given, or one is given that the command has not.
    """
    words = shlex.split(command)
    # DATA/gym-a: the first part of a path may stand for a folder.
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
    """What a command printed, with the words in capitals for the folders of this machine."""
    # The longest first: one folder may lie in another.
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

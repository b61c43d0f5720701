"""`walltopo completion`: complete commands and options with a shell's Tab key."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

SHELLS = ("bash", "zsh", "fish")

_EPILOG = """\
installation:
  bash   walltopo completion bash > ~/.local/share/bash-completion/completions/walltopo
  zsh    walltopo completion zsh > DIR/_walltopo      DIR: a folder of your $fpath
  fish   walltopo completion fish > ~/.config/fish/completions/walltopo.fish
only in this shell:
  eval "$(walltopo completion bash)"

Run it again after installing walltopo-lab, to include its commands.
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "completion",
        help="print a script that completes walltopo in bash, zsh or fish",
        description="Print a script that completes commands, options and files in a shell.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("shell", choices=SHELLS)
    parser.set_defaults(run=_completion)


def _completion(args: argparse.Namespace) -> int:
    import shtab

    from walltopo.cli import build_parser

    parser = build_parser()
    _complete_files(parser, shtab.FILE)
    sys.stdout.write(shtab.complete(parser, args.shell) + "\n")
    return 0


def _complete_files(parser: argparse.ArgumentParser, how: Mapping[str, object]) -> None:
    """Complete every path argument with files and folders."""
    for action in parser._actions:
        if action.type is Path:
            action.complete = how  # type: ignore[attr-defined]
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                _complete_files(inner, how)

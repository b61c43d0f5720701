"""`walltopo completion`: the commands and options for a shell's Tab key."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Mapping
from pathlib import Path

SHELLS = ("bash", "zsh", "fish")

_EPILOG = """\
how to use it:
  bash   walltopo completion bash > ~/.local/share/bash-completion/completions/walltopo
  zsh    walltopo completion zsh > DIR/_walltopo      DIR: a folder of your $fpath
  fish   walltopo completion fish > ~/.config/fish/completions/walltopo.fish
in this shell alone:
  eval "$(walltopo completion bash)"

Write it again after installing walltopo-lab, whose commands it then knows too.
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "completion",
        help="a script that lets the Tab key of bash, zsh or fish complete walltopo",
        description="Print the completion of commands, options and files for a shell.",
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
    """Let every argument that is a path be completed by files and folders."""
    for action in parser._actions:
        if action.type is Path:
            action.complete = how  # type: ignore[attr-defined]
        if isinstance(action, argparse._SubParsersAction):
            for inner in action.choices.values():
                _complete_files(inner, how)

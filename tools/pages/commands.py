"""The page of the command line: every command and option, generated from the parsers."""

from __future__ import annotations

import argparse
from collections.abc import Iterator

_HEAD = """\
# Commands

Every command and every option, as `--help` tells them. Exit codes are the same everywhere:

"""


def leaves(
    parser: argparse.ArgumentParser, words: tuple[str, ...] = ()
) -> Iterator[tuple[str, argparse.ArgumentParser]]:
    """Yield each executable command by its words, with its parser."""
    below = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not below:
        yield " ".join(words), parser
    for action in below:
        inner: argparse.ArgumentParser
        for name, inner in (action.choices or {}).items():
            yield from leaves(getattr(inner, "_detector", inner), (*words, name))
            # `train classifier` has its own parser, which its first word selects.
            for word, other in getattr(inner, "_others", {}).items():
                yield " ".join((*words, name, word)), other


def commands_page() -> str:
    """Return the page in Markdown."""
    from walltopo.cli import EXIT_CODES, build_parser

    lines = [_HEAD, "```text", EXIT_CODES.rstrip(), "```", ""]
    group = ""
    for words, parser in leaves(build_parser()):
        first = words.split()[0]
        if first != group:
            group = first
            lines += [f"## walltopo {first}", ""]
        if words != first:
            lines += [f"### walltopo {words}", ""]
        lines += _command(parser)
    return "\n".join(lines)


def _command(parser: argparse.ArgumentParser) -> list[str]:
    lines = []
    if parser.description:
        lines += [_cell(parser.description), ""]
    rows = [
        f"| {name} | {_cell(what)} |"
        for action in parser._actions
        if action.help != argparse.SUPPRESS and not isinstance(action, argparse._HelpAction)
        for name, what in [(_name(action), _help(action, parser))]
    ]
    if rows:
        lines += ["| option | what |", "|---|---|", *rows, ""]
    if parser.epilog:
        lines += ["```text", parser.epilog.rstrip(), "```", ""]
    return lines


def _name(action: argparse.Action) -> str:
    """Return the option with its value, or the argument."""
    value = action.metavar or "|".join(str(choice) for choice in action.choices or ())
    shown = " ".join(value) if isinstance(value, tuple) else value
    if not action.option_strings:
        return f"`{shown or action.dest.upper()}`"
    takes = "" if action.nargs == 0 else f" {shown or action.dest.upper()}"
    return ", ".join(f"`{option + takes}`" for option in action.option_strings)


def _help(action: argparse.Action, parser: argparse.ArgumentParser) -> str:
    text = (action.help or "") % {**vars(action), "prog": parser.prog} if action.help else ""
    return f"{text} (required)" if action.required and action.option_strings else text


def _cell(text: str) -> str:
    """Return help text escaped for a Markdown table cell."""
    plain = " ".join(text.split())
    for sign in ("\\", "|", "*", "_", "<", "[", "`"):
        plain = plain.replace(sign, f"\\{sign}")
    return plain

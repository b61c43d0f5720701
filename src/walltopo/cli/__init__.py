"""The command line: argparse shells over the library.

Each module of this package registers the commands of one group. This module combines them and
converts errors to messages and exit codes.
"""

from __future__ import annotations

import argparse
import errno
import importlib
import os
import sys
import traceback
from collections.abc import Iterator, Sequence
from contextlib import suppress

from walltopo import __version__
from walltopo.cli.options import Parser, check_needs
from walltopo.cli.quiet import quiet_console, quiet_libraries, show_unprintable
from walltopo.cli.stopping import STOPPED, Stop, handle_signals

# Each command and the module of this package that registers it, in the order of the help.
COMMANDS = {
    "settings": "scan",
    "scan": "scan",
    "import": "importing",
    "batch": "batch",
    "status": "status",
    "view": "view",
    "doctor": "doctor",
    "lift": "lift",
    "detect": "detect",
    "measure": "measure",
    "mesh": "mesh",
    "export": "export",
    "merge": "export",
    "palette": "palette",
    "inventory": "inventory",
    "completion": "completion",
}

# Other distributions add commands by entry points of this group: name -> `register`.
ENTRY_POINTS = "walltopo.commands"
# Commands of distributions that may not be installed: purpose, and the distribution to install.
ELSEWHERE = {
    "moves": ("find likely moves of each route", "walltopo-climb"),
    "grade": ("estimate a grade range for each route", "walltopo-climb"),
    "problem": ("propose new problems", "walltopo-climb"),
    "ease": ("make a route one grade easier or harder", "walltopo-climb"),
    "synth": ("generate gyms with exact truth", "walltopo-lab"),
    "dataset": ("make and check training data", "walltopo-lab"),
    "train": ("train a detector or a classifier", "walltopo-lab"),
    "evaluate": ("measure against truth", "walltopo-lab"),
    "tune": ("search settings", "walltopo-lab"),
    "gym": ("put a gym's walls online", "walltopo-gym"),
}

EXIT_CODES = """\
exit codes:
  0  done
  1  checked, and something needs attention: `status` (stages would run), `batch` (a scan is not
     done), `mesh check`, `dataset check`
  2  wrong usage, or an unknown or impossible setting
  3  the input is unusable (missing, damaged, too few photos)
  4  a stage found no result in usable input
  5  this machine lacks something (a program, an extra, disk space)
  70 a defect in walltopo: please report it
  130 stopped by Ctrl-C (143: by SIGTERM); run again to continue (`view` ends this way, with 0)
"""


def build_parser(word: str = "") -> argparse.ArgumentParser:
    """Return the parser of all commands, without importing heavy libraries.

    Parameters
    ----------
    word : first argument of a command line. If it is one of our commands or `--version`, the
        parser lacks the commands that this line does not name, and is made in half the time.
    """
    parser = Parser(
        prog="walltopo",
        description="Phone photos of an indoor climbing wall to a 3D topo.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"walltopo {__version__}")
    commands = parser.add_subparsers(title="commands", dest="command", metavar="COMMAND")
    if word == "--version":
        return parser
    for module in [COMMANDS[word]] if word in COMMANDS else dict.fromkeys(COMMANDS.values()):
        importlib.import_module(f"walltopo.cli.{module}").register(commands)
    if word not in COMMANDS:
        _add_plugins(commands)
    for command in leaf_parsers(parser):
        _add_common(command)
    return parser


def leaf_parsers(parser: argparse.ArgumentParser) -> Iterator[argparse.ArgumentParser]:
    """Yield the parsers of all commands and subcommands."""
    inner = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    below = [child for action in inner for child in dict.fromkeys(action.choices.values())]
    below += getattr(parser, "parsers_by_word", ())
    if not inner:
        yield getattr(parser, "parser_without_word", parser)
    for child in below:
        yield from leaf_parsers(child)


def _add_common(parser: argparse.ArgumentParser) -> None:
    """Add the common options that a command does not define itself."""
    for short, long, text in (
        ("-v", "--verbose", "more detail; the traceback of a defect"),
        ("-q", "--quiet", "errors only"),
    ):
        known = parser._option_string_actions
        names = [name for name in (short, long) if name not in known]
        if long in names:
            parser.add_argument(*names, action="store_true", help=text)


def _add_plugins(commands: argparse._SubParsersAction[Parser]) -> None:
    """Add the commands of installed distributions, and placeholders for those not installed."""
    from importlib.metadata import entry_points

    found = set()
    for point in sorted(entry_points(group=ENTRY_POINTS), key=lambda point: point.name):
        point.load()(commands)
        found.add(point.name)
    for name, (purpose, distribution) in ELSEWHERE.items():
        if name not in found:
            parser = commands.add_parser(
                name, help=f"{purpose} (needs {distribution})", add_help=False
            )
            parser.add_argument("rest", nargs=argparse.REMAINDER)
            parser.set_defaults(run=_missing, distribution=distribution)


def _missing(args: argparse.Namespace) -> int:
    from walltopo.core import EnvironmentLacksError

    raise EnvironmentLacksError(
        f"`walltopo {args.command}` comes with {args.distribution}, which is not installed",
        f"pip install {args.distribution}",
    )


def _limit_blas() -> None:
    """Let NumPy's products run in the calling thread, unless the user's environment says how many.

    They are small here: the threads of OpenBLAS would mostly wait for each other (on two cores the
    stage `texture` takes 0.64 of the processor time without them), and the last bits of a sum would
    depend on the number of cores.
    """
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    _limit_blas()
    args = argparse.Namespace()
    show_unprintable()
    with handle_signals() as stop:
        try:
            given = sys.argv[1:] if arguments is None else list(arguments)
            parser = build_parser(given[0] if given else "")
            parser.parse_args(given, namespace=args)
            if not hasattr(args, "run"):
                parser.print_help()
                return 2
            check_needs(args)
            verbose, quiet = (getattr(args, name, False) for name in ("verbose", "quiet"))
            with quiet_libraries(verbose), quiet_console(quiet):
                return int(args.run(args))
        except KeyboardInterrupt:
            sys.stderr.write(f"\n{STOPPED}\n")
            return stop.exit_code
        except BrokenPipeError:
            sys.stderr.close()
            return 0
        except Exception as error:
            return _report(error, stop, getattr(args, "verbose", False))


def _report(error: Exception, stop: Stop, verbose: bool) -> int:
    """Print an error and return the exit code."""
    from walltopo.cli.console import error_console
    from walltopo.core import WalltopoError

    def show(what: str, text: str) -> None:
        error_console.print(what, style="bold red", end=" ")
        error_console.print(text, soft_wrap=True)

    if stop.number:  # a library raised this error because of the interruption
        sys.stderr.write(f"\n{STOPPED}\n")
        return stop.exit_code
    if isinstance(error, WalltopoError):
        show("error:", error.message)
        if error.hint:
            error_console.print(error.hint, soft_wrap=True, style="dim")
        return error.exit_code
    if isinstance(error, MemoryError):
        show("error:", "this machine does not have enough memory for this input")
        return 5
    if isinstance(error, OSError):
        where = f"{error.filename}: " if error.filename else ""
        show("error:", f"{where}{error.strerror or error}")
        if verbose:
            error_console.print(traceback.format_exc(), soft_wrap=True)
        return _os_exit_code(error)
    show("defect in walltopo:", type(error).__name__)
    error_console.print(str(error), soft_wrap=True)
    if verbose:
        error_console.print(traceback.format_exc(), soft_wrap=True)
    else:
        error_console.print("run again with -v for the traceback, and report it", style="dim")
    return 70


def _os_exit_code(error: OSError) -> int:
    """Return the exit code for an error of the operating system, such as a full disk."""
    if error.errno == errno.ENOSPC:  # stdout itself may be full, and Python would flush it again
        with suppress(OSError):
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
    return 3 if error.errno == errno.ENAMETOOLONG else 5


if __name__ == "__main__":
    sys.exit(main())

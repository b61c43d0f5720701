"""`walltopo view`: show a scan in the browser, and its address as a QR code."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number
from walltopo.core import InputError

if TYPE_CHECKING:
    from rich.console import Console
    from starlette.routing import BaseRoute

    from walltopo.pipeline.first_look import FollowedScan
    from walltopo.scans.folder import ScanFolder


_EXAMPLES = """\
examples:
  walltopo view wall                               while the scan runs, too
  walltopo view wall --host 192.168.1.20           on a phone: scan the QR code
  walltopo view wall --host 192.168.1.20 --edit    the QR code includes the token for editing
"""


Commands = argparse._SubParsersAction  # argparse has no public name for it


def register(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add this group's commands."""
    view = commands.add_parser(
        "view",
        help="show a scan in the browser (serves it on localhost)",
        description="Show a scan in the browser, until Ctrl-C.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    view.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    view.add_argument(
        "--port", type=Number(int, low=0, high=65535), default=8000, help="port (0: any free one)"
    )
    view.add_argument("--edit", action="store_true", help="enable the editor, which saves edits")
    view.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="NAME",
        help="name or address of this machine, for viewers elsewhere in the network; prints a QR "
        "code for phones",
    )
    view.add_argument(
        "--embed",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin embed the wall in a frame, e.g. https://gym.example",
    )
    view.set_defaults(run=_view)


def _editor_routes(args: argparse.Namespace) -> tuple[Sequence[BaseRoute], Callable[[], None]]:
    """Return the editor's HTTP routes (none without `--edit`) and a function that closes it."""
    if not args.edit:
        return (), lambda: None
    from walltopo.editing.http import editor_routes
    from walltopo.pipeline.edit_session import open_session
    from walltopo.scans.folder import ScanFolder

    session = open_session(ScanFolder(args.scan))
    return editor_routes(session), session.close


def _unfinished_scan(scan: ScanFolder, edit: bool) -> FollowedScan | None:
    """Return a scan without a page, to follow it; None for one that has its page.

    Raises
    ------
    InputError : there is no scan, or one without a page shall be edited.
    """
    if scan.page.is_file():
        return None
    if not scan.manifest.is_file():
        raise InputError(
            f"{scan.root}: no page to show",
            f"Begin a scan: `walltopo scan PHOTOS -o {scan.root}`.",
        )
    if edit:
        raise InputError(
            f"{scan.root}: no page to edit", f"Finish `walltopo scan -o {scan.root}` first."
        )
    from walltopo.pipeline.first_look import FollowedScan

    return FollowedScan(scan)


def _view(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console, error_console
    from walltopo.publish.server.run import Server
    from walltopo.scans.folder import ScanFolder

    unfinished = _unfinished_scan(ScanFolder(args.scan), args.edit)

    def print_defect(text: str) -> None:
        error_console.print(text, soft_wrap=True)

    server = Server(
        args.scan,
        args.port,
        args.host,
        args.embed,
        print_defect,
        *_editor_routes(args),
        unfinished,
    )
    console.print(server.url, style="bold", soft_wrap=True)
    for line in server.notes():
        console.print(line, soft_wrap=True)
    if not server.address.local and show_qr(console, server.url):
        console.print(
            "Scan the code with a phone in the same network"
            + ("; it includes the token: anyone who scans it can save edits." if args.edit else ".")
        )
    if unfinished is not None:
        console.print("The scan has no page yet: the address shows the wall as far as it is known.")
    console.print("Ctrl-C stops.")
    server.run()
    console.print("stopped")
    return 0


BORDER = 2  # of light modules; phones need fewer than the standard's four
# (upper module dark, lower module dark) to the character that draws both
_HALVES = {(0, 0): " ", (1, 0): "▀", (0, 1): "▄", (1, 1): "█"}


def qr_lines(address: str, dark_on_light: bool = True) -> list[str]:
    """Return a QR code as text lines, each two rows of modules.

    With `dark_on_light` the characters draw the dark modules, otherwise the light ones.
    """
    import segno

    # `micro=False`: phone cameras do not read Micro QR.
    code = segno.make(address, error="l", micro=False, boost_error=False)
    rows = [[int(bool(module)) for module in row] for row in code.matrix_iter(border=BORDER)]
    if not dark_on_light:
        rows = [[1 - module for module in row] for row in rows]
    if len(rows) % 2:
        rows.append([0 if dark_on_light else 1] * len(rows[0]))
    pairs = zip(rows[::2], rows[1::2], strict=True)
    return ["".join(_HALVES[pair] for pair in zip(*both, strict=True)) for both in pairs]


def show_qr(console: Console, address: str) -> bool:
    """Print the QR code if the terminal is wide enough; return whether it was printed."""
    from rich.text import Text

    coloured = console.color_system is not None
    lines = qr_lines(address, dark_on_light=coloured)
    if not console.is_terminal or len(lines[0]) > console.width:
        return False
    # Without colours the code assumes light text on a dark background.
    style = "black on bright_white" if coloured else ""
    for line in lines:
        console.print(Text(line, style), soft_wrap=True)
    return True

"""`walltopo view`: a scan in the browser."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number
from walltopo.core import InputError

_EXAMPLES = """\
examples:
  walltopo view wall
  walltopo view wall --host 192.168.1.20           on a phone: scan the code that is shown
  walltopo view wall --host 192.168.1.20 --edit    the code has the token: it lets a phone edit
"""

if TYPE_CHECKING:
    from starlette.routing import BaseRoute

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
    view.add_argument("--edit", action="store_true", help="with the editor; saves edit files")
    view.add_argument(
        "--host",
        default="127.0.0.1",
        metavar="NAME",
        help="name or address of this machine in the network, for viewers elsewhere in it; shows "
        "a QR code for a phone",
    )
    view.add_argument(
        "--embed",
        action="append",
        default=[],
        metavar="ORIGIN",
        help="let pages of this origin show the wall in a frame, e.g. https://gym.example",
    )
    view.set_defaults(run=_view)


def _editor(args: argparse.Namespace) -> tuple[Sequence[BaseRoute], Callable[[], None]]:
    """Return the editor's routes and what ends its session; none without `--edit`."""
    if not args.edit:
        return (), lambda: None
    from walltopo.editing.http import editor_routes
    from walltopo.pipeline.edit_session import open_session
    from walltopo.scans.folder import ScanFolder

    session = open_session(ScanFolder(args.scan))
    return editor_routes(session), session.close


def _view(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console, error_console
    from walltopo.cli.qr import show_qr
    from walltopo.publish.server.run import Server
    from walltopo.scans.folder import ScanFolder

    if not ScanFolder(args.scan).page.is_file():
        raise InputError(
            f"{args.scan}: no page to show", f"Run `walltopo scan -o {args.scan}` to its end first."
        )

    def tell(text: str) -> None:
        error_console.print(text, soft_wrap=True)

    server = Server(args.scan, args.port, args.host, args.embed, tell, *_editor(args))
    console.print(server.url, style="bold", soft_wrap=True)
    for line in server.notes():
        console.print(line, soft_wrap=True)
    if not server.address.local and show_qr(console, server.url):
        console.print(
            "Scan it with a phone in the same network"
            + ("; the code has the token: who scans it can save edits." if args.edit else ".")
        )
    console.print("Ctrl-C stops.")
    server.run()
    console.print("stopped")
    return 0

"""`walltopo gym demo`: create and serve a demo gym."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Final

PHOTOS: Final = ("examples/demo-photos", "examples/demo-photos-harbour")
_CLIP: Final = (Path("examples/demo-clip.mp4"), "Corner", "red")  # of the first wall's red route


def register(inner: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `demo` command."""
    demo = inner.add_parser("demo", help="serve a demo gym; made by a real scan at the first start")
    demo.add_argument(
        "--data", type=Path, metavar="DIR", required=True, help="kept for the next start"
    )
    demo.add_argument(
        "--photos",
        type=Path,
        metavar="DIR",
        nargs="+",
        help=f"of a wall each (default: {' '.join(PHOTOS)}, and a clip of a climber)",
    )
    demo.add_argument("--port", help="port to listen on; 0: any free one (default 8080)")
    demo.add_argument("--no-serve", action="store_true", help="make it, and end")
    demo.set_defaults(run=_demo)


def _demo(args: argparse.Namespace) -> int:
    import logging.config

    from walltopo.cli.console import console
    from walltopo_gym.cli.gym_data import database_of
    from walltopo_gym.demo.clip import DemoClip
    from walltopo_gym.demo.hall import SLUG, Hall
    from walltopo_gym.server.request_log import log_config
    from walltopo_gym.server.run import serve
    from walltopo_gym.settings import load_settings
    from walltopo_gym.storage.files import open_store

    settings = load_settings({"data": args.data, "port": args.port})
    logging.config.dictConfig(log_config(settings.log))
    with database_of(settings) as database:
        hall = Hall(settings, database, open_store(settings), console.print)
        if args.photos is None:
            accounts = hall.make([Path(name) for name in PHOTOS], DemoClip(*_CLIP))
        else:
            accounts = hall.make(args.photos)

    def tell(address: str) -> None:
        port = address.rpartition(":")[2]
        console.print(f"http://localhost:{port}/g/{SLUG}", style="bold", soft_wrap=True)
        console.print("Ctrl-C stops.")

    for email, password in accounts.items():
        console.print(f"{email:<22} {password}", soft_wrap=True, markup=False, highlight=False)
    console.print("Its climbers, their ascents and its two competitions are made up.")
    if not args.no_serve:
        serve(settings, tell)
    return 0

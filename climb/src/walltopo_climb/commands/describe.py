"""`walltopo describe`: a route in words."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import Number

_EXAMPLES = """examples:
  walltopo describe wall --route 2
  walltopo describe wall --route 2 --height 1.62 --language de --detail full
  walltopo describe wall --route 2 --unit hands --format json
"""

Commands = argparse._SubParsersAction  # argparse has no public name for it


def register_describe(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo describe`."""
    describe = commands.add_parser(
        "describe",
        help="a route in words, move by move, for climbers who hear it",
        description="Describe a route in words: start, each move by limb, direction on the clock's "
        "face, distance and type of the hold, and the top. The moves are those that the movement "
        "model finds likely for a body of this height.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    describe.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    describe.add_argument(
        "--route", type=Number(int, 1), required=True, metavar="ID", help="its number"
    )
    describe.add_argument(
        "--height",
        type=Number(float, 0.9, 2.3),
        default=1.75,
        metavar="M",
        help="of the climber [m] (default: 1.75)",
    )
    describe.add_argument(
        "--reach", type=Number(float, 0.7, 2.8), default=0.0, metavar="M", help="arm span [m]"
    )
    describe.add_argument("--language", choices=("en", "de", "cs", "fr"), default="en")
    describe.add_argument(
        "--detail",
        choices=("short", "normal", "full"),
        default="normal",
        help="short: the hands alone; full: with sizes and heights (default: normal)",
    )
    describe.add_argument(
        "--unit", choices=("centimetres", "hands"), default="centimetres", help="of distances"
    )
    describe.add_argument("--format", choices=("text", "json"), default="text")
    describe.set_defaults(run=_describe)


def _describe(args: argparse.Namespace) -> int:
    import msgspec

    from walltopo.cli.console import console
    from walltopo_climb.description.route_text import describe_route
    from walltopo_climb.description.sentences import Wording
    from walltopo_climb.movement.body import Body

    described = describe_route(
        args.scan,
        args.route,
        Body(args.height, args.reach),
        Wording(args.language, args.detail, args.unit),
    )
    if args.format == "json":
        text = msgspec.json.format(msgspec.json.encode(described), indent=1).decode()
        console.out(text, highlight=False)
        return 0
    console.out(described.text, highlight=False)
    if not described.metric:
        console.print("The scan has no scale: distances and heights are estimated.", soft_wrap=True)
    return 0

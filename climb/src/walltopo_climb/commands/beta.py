"""`walltopo beta`: the holds that a climber used in a clip."""

from __future__ import annotations

import argparse
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number, add_overwrite, output_target

if TYPE_CHECKING:
    from rich.table import Table

    from walltopo.scans.attempt import AttemptFile
    from walltopo_climb.beta.scanned_wall import ScannedWall

_EXAMPLES = """examples:
  walltopo beta clip.mp4 --scan wall                     the route that fits best
  walltopo beta clip.mp4 --scan wall --route 2 -o attempt.json
"""

Commands = argparse._SubParsersAction  # argparse has no public name for it


def register_beta(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo beta`."""
    beta = commands.add_parser(
        "beta",
        help="the holds that a climber used in a clip, in their order",
        description="Read a clip of an attempt: find where on the scanned wall it was filmed, "
        "follow the climber, and list which hand or foot was on which hold, and when. The clip "
        "shows the whole body and some metres of the wall; it is at most three minutes long.",
        epilog=_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    beta.add_argument("clip", type=Path, metavar="CLIP", help="a video")
    beta.add_argument(
        "--scan", type=Path, required=True, metavar="SCAN", help="the scan folder of the wall"
    )
    beta.add_argument(
        "--route",
        type=Number(int, 1),
        metavar="ID",
        help="the route that was tried (default: the one that fits best)",
    )
    beta.add_argument(
        "-o", "--output", type=Path, metavar="FILE", help="write the attempt as JSON to FILE"
    )
    add_overwrite(beta)
    beta.set_defaults(run=_beta)


def _beta(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import written_file
    from walltopo.scans.folder import ScanFolder
    from walltopo_climb.beta.attempt_file import attempt_file
    from walltopo_climb.beta.clip import read_clip
    from walltopo_climb.beta.scanned_wall import ScannedWall

    with ExitStack() as stack:
        made = None
        if args.output is not None:
            target = output_target(args, args.output, "beta", inputs=[args.clip])
            made = stack.enter_context(written_file(target))
        progress = stack.enter_context(TerminalListener(console))
        progress.step("reading the scan")
        wall = ScannedWall.load(ScanFolder(args.scan))
        reading = read_clip(args.clip, wall, args.route, progress)
        attempt = attempt_file(reading, wall, args.clip.name)
        if made is not None:
            attempt.save(made)
    console.print(_table(attempt, wall))
    console.print(_attempt_summary(attempt, wall), soft_wrap=True)
    return 0


def _attempt_summary(attempt: AttemptFile, wall: ScannedWall) -> str:
    """Return one line on an attempt: the route, and how far the climber came."""
    from walltopo.scans.routes import route_name

    route = next((one for one in wall.routes if one.id == attempt.route), None)
    hands = sum(move.limb.endswith("hand") for move in attempt.moves)
    words = [f"{hands} moves of the hands in {attempt.length:.0f} s"]
    if attempt.top is not None:
        words.append(f"top at {attempt.top:.1f} s")
    elif attempt.fall is not None:
        words.append(f"fall at {attempt.fall:.1f} s, highest hold {attempt.highest}")
    else:
        words.append(f"no top, highest hold {attempt.highest}")
    if attempt.foreign:
        words.append(f"{attempt.foreign:.0%} of the hands' holds belong to other routes")
    return f"{'no route fits' if route is None else route_name(route)}: {', '.join(words)}"


def _table(attempt: AttemptFile, wall: ScannedWall) -> Table:
    from rich.table import Table

    from walltopo_climb.movement.sequence import LIMBS

    colours = {hold.id: hold.colour for hold in wall.holds}
    table = Table()
    for name in ("time [s]", "limb", "hold", "colour", "confidence"):
        table.add_column(name)
    for move in attempt.moves:
        hold = move.holds[LIMBS.index(move.limb)]
        table.add_row(
            f"{move.time:.1f}",
            move.limb,
            str(hold or "wall"),
            colours.get(hold, ""),
            f"{move.confidence:.2f}",
        )
    return table

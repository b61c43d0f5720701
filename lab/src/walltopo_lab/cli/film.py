"""`walltopo film`: clips of climbers on a generated gym, with exact truth."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import Number, add_needs, add_overwrite, output_target
from walltopo_lab.extras import SHAPES

_EXAMPLE = """example:
  walltopo synth gym3 --seed 3
  walltopo film gym3 -o clips --count 12
  walltopo evaluate beta clips --scan wall --truth gym3
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `film` command."""
    parser = commands.add_parser(
        "film",
        help="clips of climbers on a generated gym, with exact truth",
        description="Render clips of a body that climbs routes of a generated gym: phones that "
        "stand and that a hand holds, falls and tops, people who walk by. Each N.mp4 has its truth "
        "(contacts, cameras) in N.json. Run again to resume, or with "
        "a larger --count to add clips.",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("gym", type=Path, metavar="GYM", help="a folder of `walltopo synth`")
    parser.add_argument(
        "-o", "--output", type=Path, required=True, metavar="CLIPS", help="the folder to write"
    )
    parser.add_argument(
        "--count", type=Number(int, low=1, high=1000), default=8, help="number of clips (8)"
    )
    add_overwrite(parser)
    parser.set_defaults(run=_film)
    add_needs(parser, SHAPES)


def _film(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.synth.film import film_gym

    claimed_folder(output_target(args, args.output, "film", inputs=[args.gym]))
    with TerminalListener(console) as listener:
        clips = list(film_gym(args.gym, args.output, args.count, progress=listener))
    seconds = sum(truth.length for _, truth in clips)
    console.print(f"{args.output}: {len(clips)} clips, {seconds:.0f} s")
    return 0

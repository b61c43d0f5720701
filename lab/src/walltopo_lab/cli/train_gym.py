"""`walltopo train gym`: train the shipped network further on corrected scans of one gym."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import Number, Parser, add_needs, add_overwrite, output_target
from walltopo_lab.extras import PLOTS, modules_of

EXAMPLES = """\
example:
  walltopo train gym wall1 wall2 -o ours
  walltopo scan photos/ -o wall3 --set detect.model=ours/holds.onnx
The same command goes on where the last one stopped.
"""
_MINUTES = 10.0


def gym_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train gym`."""
    parser = Parser(
        prog=prog,
        description="Train the shipped network further on scans of one gym with their "
        "corrections, and compare both networks on a stretch of the walls that was held out.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scans", type=Path, nargs="+", help="scan folders with corrected holds")
    parser.add_argument(
        "-o",
        "--out",
        type=Path,
        required=True,
        help="folder of the run: holds.onnx, its card, and own.json with the comparison",
    )
    add_overwrite(parser)
    parser.add_argument(
        "--minutes",
        type=Number(float, low=0.01),
        default=_MINUTES,
        help=f"time to train, all resumed parts together (default {_MINUTES:g})",
    )
    parser.set_defaults(run=run)
    add_needs(parser, lambda _: {**modules_of("train"), **PLOTS})
    return parser


def run(args: argparse.Namespace) -> int:
    """Train, compare, and print whether the gym's own network is better; return exit code 0."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import claimed_folder
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.train.own_network import train_own

    scans = [ScanFolder(folder) for folder in args.scans]
    claimed_folder(output_target(args, args.out, "train gym", inputs=args.scans))
    with TerminalListener(console) as progress:
        own = train_own(scans, args.out, args.minutes, progress)
    console.print(
        f"AP50 of masks on {own.held_out} photos held out: {own.before.masks:.3f} with the shipped "
        f"network, {own.after.masks:.3f} with {args.out / 'holds.onnx'} "
        f"(mean of classes {own.before.mean:.3f}, {own.after.mean:.3f})",
        soft_wrap=True,
    )
    advice = "Better: use it." if own.better else "Not better: keep the shipped network."
    console.print(advice)
    return 0

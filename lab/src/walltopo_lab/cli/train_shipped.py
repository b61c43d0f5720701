"""`walltopo train hold-types`, `two-colours` and `paint`: train further shipped models."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import MAX_SEED, Number, Parser, add_needs, add_overwrite, output_target
from walltopo_lab.extras import LEARN, SHAPES, modules_of

HOLD_TYPES = """\
examples:
  walltopo train hold-types -o hold_types.onnx
  walltopo train hold-types -o hold_types.onnx --scans GYM1 SCAN1 GYM2 SCAN2
then replace src/walltopo/models/hold_types.onnx, and print the figures again:
  python -m benchmarks.types scans GYM SCAN
"""

TWO_COLOURS = """\
example:
  walltopo train two-colours gyms/ --photos DATA/hold-boxes/train/images -o two_colours.onnx
then replace src/walltopo/models/two_colours.onnx, and print the figures again:
  python -m benchmarks.two_colours FOLDER
"""

PAINT = """\
example:
  walltopo train paint photos/
Its numbers stand in src/walltopo/describe/routes/grouping.py, the resolution among them;
their figure on other gyms is printed by
  python -m benchmarks.routes dim CHECK
"""


def hold_types_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train hold-types`."""
    parser = Parser(
        prog=prog,
        description="Train the network that names hold types by their relief, on made-up holds "
        "with the faults of a scan; five minutes of one core.",
        epilog=HOLD_TYPES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("-o", "--out", type=Path, required=True, help="ONNX file to write")
    add_overwrite(parser)
    parser.add_argument(
        "--scans",
        type=Path,
        nargs="+",
        default=[],
        metavar="GYM SCAN",
        help="gyms of `walltopo synth` and scans of their photos, up to lift: how sure a type must "
        "be is chosen on these rather than on made-up holds",
    )
    parser.set_defaults(run=run_hold_types)
    add_needs(parser, {**modules_of("train"), **SHAPES})
    return parser


def two_colours_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train two-colours`."""
    parser = Parser(
        prog=prog,
        description="Train the network that finds two-coloured holds, on photos of generated gyms; "
        "ninety minutes of two cores, half of it for the photos.",
        epilog=TWO_COLOURS,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path, help="of the gyms; made where they are not there")
    parser.add_argument("-o", "--out", type=Path, required=True, help="ONNX file to write")
    add_overwrite(parser)
    _add_gyms(parser, 6300, 33)
    parser.add_argument(
        "--photos",
        type=Path,
        metavar="FOLDER",
        help="photos of real walls, nearly all of whose holds have one colour",
    )
    parser.set_defaults(run=run_two_colours)
    add_needs(parser, {**modules_of("train"), **SHAPES})
    return parser


def _add_gyms(parser: argparse.ArgumentParser, first: int, count: int) -> None:
    parser.add_argument(
        "--gyms",
        type=Number(int, low=0, high=MAX_SEED),
        nargs=2,
        default=(first, count),
        metavar=("FIRST", "COUNT"),
        help=f"seeds of the gyms (default: {first} {count})",
    )


def paint_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train paint`."""
    parser = Parser(
        prog=prog,
        description="Fit how likely two holds are of one route by their paint (routes.link = "
        "paint), on photos of generated gyms in dim, mixed light.",
        epilog=PAINT,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("folder", type=Path, help="of the photos; made where they are not there")
    _add_gyms(parser, 4000, 18)
    add_overwrite(parser)
    parser.set_defaults(run=run_paint)
    add_needs(parser, {**LEARN, **SHAPES})
    return parser


def run_hold_types(args: argparse.Namespace) -> int:
    """Train the hold-type network, choose its confidence threshold, and write it."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core import SettingsError

    if len(args.scans) % 2:
        raise SettingsError("--scans wants a gym and its scan, in turn")
    from walltopo.core.outputs import written_file
    from walltopo_lab.train.hold_types.fit import fit_hold_types

    scans = list(zip(args.scans[::2], args.scans[1::2], strict=True))
    with (
        written_file(output_target(args, args.out, "train hold-types")) as made,
        TerminalListener(console) as progress,
    ):
        certain = fit_hold_types(made, scans, progress)
    console.print(f"{args.out}: named from a probability of {certain}", soft_wrap=True)
    return 0


def run_two_colours(args: argparse.Namespace) -> int:
    """Train the network of two-coloured holds, choose its threshold, and write it."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import claimed_folder, written_file
    from walltopo.segment.detect.photos import photos_in
    from walltopo_lab.train.two_colours.fit import fit_two_colours

    command = "train two-colours"
    photos = photos_in(args.photos) if args.photos else []
    claimed_folder(output_target(args, args.folder, command, flag="FOLDER"))
    with (
        written_file(output_target(args, args.out, command)) as made,
        TerminalListener(console) as progress,
    ):
        first, count = args.gyms
        certain, recall = fit_two_colours(made, args.folder, first, count, photos, progress)
    console.print(
        f"{args.out}: two colours from a probability of {certain:.3f}; {recall:.0%} of the "
        "two-coloured holds of the gyms held out are found",
        soft_wrap=True,
    )
    return 0


def run_paint(args: argparse.Namespace) -> int:
    """Render missing photos, fit the paint model, and print it."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.train.paint.fit import fit_paint
    from walltopo_lab.train.paint.photos import make_photos, read_photos

    with TerminalListener(console) as progress:
        first, count = args.gyms
        claimed_folder(output_target(args, args.folder, "train paint", flag="FOLDER"))
        make_photos(args.folder, first, count, progress)
        found = fit_paint(read_photos(args.folder), progress)
    for (sharpen, resolution), (mean, worst) in found.left_out.items():
        console.print(
            f"sharpen {sharpen}, resolution {resolution}: mean ARI {mean:.3f}, worst {worst:.3f}"
        )
    console.print(f"WEIGHTS = {tuple(found.weights)}\nBIAS = {found.bias}", soft_wrap=True)
    return 0

"""`walltopo train pack`: write prepared photos as one file, to train on another machine."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from walltopo.cli.options import Number, Parser, add_needs, add_overwrite, output_target
from walltopo_lab.extras import modules_of

EXAMPLES = """\
example:
  walltopo train pack hold-boxes/train synth/coco.json -o sets.pack --outlines onnx
then, on the machine with the GPU
  walltopo train --pack sets.pack -o run --device cuda --minutes 20
"""
_HELD_OUT, _QUALITY = 0.08, 76


def pack_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train pack`."""
    parser = Parser(
        prog=prog,
        description="Write the prepared photos of labelled sets as one file of at most 50 MB: "
        "photos as WebP, instance maps as PNG, labels.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "datasets", type=Path, nargs="+", help="YOLO folders (images/, labels/), COCO .json files"
    )
    parser.add_argument("-o", "--out", type=Path, required=True, help="file to write")
    add_overwrite(parser)
    parser.add_argument(
        "--held-out",
        type=Number(float, low=0.0, high=0.5),
        default=_HELD_OUT,
        help=f"share of the sources kept for choosing (default {_HELD_OUT})",
    )
    parser.add_argument(
        "--quality",
        type=Number(int, low=1, high=100),
        default=_QUALITY,
        help=f"quality of the photos as WebP (default {_QUALITY})",
    )
    parser.add_argument(
        "--outlines",
        metavar="FILE|onnx",
        help="a network of `walltopo train` (onnx: the shipped one) draws the masks in labelled "
        "boxes; default: colours do",
    )
    parser.set_defaults(run=run)
    add_needs(parser, lambda _: modules_of("train"))
    return parser


def _mask_drawer(outlines: str | None) -> Any:
    """Return a function that draws masks with the named network, or None."""
    from functools import partial

    from walltopo.segment.detect.detector import shipped_model
    from walltopo_lab.train.outlines import redraw
    from walltopo_lab.train.warm import load_exported

    if outlines is None:
        return None
    path = shipped_model() if outlines == "onnx" else Path(outlines)
    return partial(redraw, load_exported(path).eval())


def run(args: argparse.Namespace) -> int:
    """Write the pack and return exit code 0."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import written_file
    from walltopo_lab.detectors.fetch import cache_folder
    from walltopo_lab.train.pack import write_pack
    from walltopo_lab.train.sets import open_sets

    to = output_target(args, args.out, "train pack", inputs=args.datasets)
    with written_file(to) as made, TerminalListener(console) as progress:
        cache = cache_folder() / "train" / "prepared"
        sets = open_sets(args.datasets, cache, args.held_out, progress)
        size = write_pack(made, sets, progress, args.quality, redraw=_mask_drawer(args.outlines))
    photos = sum(len(item.train) + len(item.held_out) for item in sets)
    console.print(f"{args.out}: {photos} photos, {size / 1e6:.1f} MB", soft_wrap=True)
    return 0

"""`walltopo detect`: find holds and volumes in photos, without a scan."""

from __future__ import annotations

import argparse
from contextlib import nullcontext
from pathlib import Path

from walltopo.cli.options import add_options, add_overwrite, options_given, output_target
from walltopo.segment.settings import DetectSettings

EXAMPLES = """\
examples:
  walltopo detect photos/ -o detections.json
  walltopo detect wall.jpg -o detections.json --draw pictures/
  walltopo detect photos/ -o detections.json --model our-gym.onnx --score 0.4
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "detect",
        help="find holds and volumes in photos",
        description="Find holds and volumes in photos and write them as COCO: masks (RLE), boxes "
        "and scores, in the pixels of each photo.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("photos", type=Path, nargs="+", help="photos, or folders of photos")
    parser.add_argument("-o", "--output", type=Path, required=True, help="the COCO file to write")
    parser.add_argument("--draw", type=Path, metavar="DIR", help="also write pictures here")
    add_overwrite(parser)
    parser.add_argument("-v", "--verbose", action="store_true", help="print a line per photo")
    add_options(parser.add_argument_group("settings"), DetectSettings)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Detect objects, write them and print their number."""
    settings = options_given(args, DetectSettings)

    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import written_file, written_folder
    from walltopo.segment.detect.detector import open_detector
    from walltopo.segment.detect.photos import detect_photos, photos_in

    photos = [p for given in args.photos for p in (photos_in(given) if given.is_dir() else [given])]
    detector = open_detector(settings)
    drawings = output_target(args, args.draw, "detect --draw", flag="--draw", inputs=photos)
    with (
        written_file(output_target(args, args.output, "detect", inputs=photos)) as made,
        written_folder(drawings) if args.draw else nullcontext() as pictures,
        TerminalListener(console, verbose=args.verbose) as progress,
    ):
        found, figures = detect_photos(photos, detector, progress, pictures)
        found.save(made)
    console.print(
        f"{figures['masks']} objects in {figures['photos']} photos "
        f"({figures['seconds_per_photo']:.2f} s a photo), written to {args.output}",
        soft_wrap=True,
    )
    return 0

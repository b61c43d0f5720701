"""`walltopo measure`: print scale plates, and find them in photos."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number, add_overwrite, output_target

if TYPE_CHECKING:
    from walltopo.images.markers import Detection
    from walltopo.reconstruct.scale.plates import Plate


_EPILOG = """\
examples:
  walltopo measure print -o plate.pdf                  an A4 plate
  walltopo measure print -o plate.pdf --paper a3 --number 2
  walltopo measure print -o stickers.pdf --stickers 24 for bare walls
  walltopo measure detect photos/                      list the markers in each photo
  walltopo measure plates > plates.toml                the built-in plates, as a start for your own
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add this group's commands."""
    measure = commands.add_parser(
        "measure",
        help="the printed scale plate that gives a scan its metres, up and floor",
        description="Print a scale plate, or find it in photos.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    group = measure.add_subparsers(dest="measure_command", required=True, metavar="COMMAND")
    _register_print(group)
    detect = group.add_parser(
        "detect",
        help="list the markers in each photo",
        description="Find the markers of plates and stickers in photos, without a scan.",
    )
    detect.add_argument("photos", nargs="+", type=Path, metavar="PHOTOS", help="files or folders")
    detect.add_argument("--plates", type=Path, metavar="FILE", help="TOML of your own plates")
    detect.set_defaults(run=_detect)
    plates = group.add_parser("plates", help="print the TOML of the built-in plates")
    plates.set_defaults(run=_plates)


def _register_print(group: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    printing = group.add_parser(
        "print",
        help="write a plate as a PDF at true size",
        description="Write a plate of four ArUco markers as a PDF to print at 100 %.",
    )
    printing.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="the PDF")
    add_overwrite(printing)
    printing.add_argument(
        "--paper", choices=("a4", "a3", "letter"), default="a4", help="default: a4"
    )
    printing.add_argument(
        "--number",
        type=Number(int, low=1),
        default=1,
        metavar="N",
        help="number of the plate: use different numbers for several plates (default: 1)",
    )
    printing.add_argument(
        "--stickers",
        type=Number(int, low=1, high=587),
        default=0,
        metavar="COUNT",
        help="write sheets of stickers instead; two a metre of bare wall tie its photos",
    )
    printing.add_argument("--plates", type=Path, metavar="FILE", help="TOML of your own plates")
    printing.set_defaults(run=_print)


def _print(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.outputs import written_file
    from walltopo.reconstruct.scale.plate_pdf import PAPERS, draw_plate, draw_stickers, to_pdf

    paper = PAPERS[args.paper]
    if args.stickers:
        pages = draw_stickers(range(args.stickers), paper)
        what = f"{args.stickers} stickers"
        hint = f"{len(pages)} page(s). Print at 100 %, cut, and stick each once on the wall."
    else:
        plate = _plate_to_print(args)
        pages = [draw_plate(plate, paper)]
        what = f"plate {plate.label}"
        hint = f"markers of {1000 * plate.marker:g} mm. Print at 100 % and check its ruler."
    pdf = to_pdf(pages, paper, f"walltopo measure {what}")
    with written_file(
        output_target(args, args.out, "measure print", inputs=[args.plates])
    ) as temporary:
        temporary.write_bytes(pdf)
    console.print(f"{args.out}: {what} for {args.paper.upper()}, {hint}")
    return 0


def _plate_to_print(args: argparse.Namespace) -> Plate:
    """Return the plate of the arguments; raise SettingsError if there is none of that number."""
    from walltopo.core import SettingsError
    from walltopo.reconstruct.scale.plates import built_in_plates, read_plates

    if args.plates:
        kinds = read_plates(args.plates)
    else:
        kinds = [plate for plate in built_in_plates() if plate.name == args.paper]
    if not 1 <= args.number <= len(kinds):
        raise SettingsError(f"--number: expected 1 to {len(kinds)}, got {args.number}")
    return kinds[args.number - 1]


def _detect(args: argparse.Namespace) -> int:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.core import Silent
    from walltopo.images.markers import detect_stickers
    from walltopo.reconstruct.scale.plates import built_in_plates, read_plates
    from walltopo.reconstruct.scale.world_frame import detect_in_photos
    from walltopo.scans.photos import PhotoSet

    plates = read_plates(args.plates) if args.plates else built_in_plates()
    table = Table("photo", "plate", "markers", "shortest side")
    photos: dict[str, set[str]] = {}
    for path in args.photos:
        files = sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
        for file in files:
            photo = PhotoSet(file.parent)
            found = detect_in_photos(photo, [file.name], plates, Silent())
            if stickers := detect_stickers(photo.read_grey(file.name), file.name):
                codes = ", ".join(str(code) for code in sorted(one.marker for one in stickers))
                table.add_row(file.name, "stickers", codes, f"{_shortest_side(stickers):.0f} px")
            for plate in plates:
                seen = [d for d in found if d.marker in plate.ids]
                seen = [d for d in seen if d.dictionary == plate.dictionary]
                if seen:
                    photos.setdefault(plate.label, set()).add(file.name)
                    ids = ", ".join(str(d.marker) for d in sorted(seen, key=lambda d: d.marker))
                    table.add_row(file.name, plate.label, ids, f"{_shortest_side(seen):.0f} px")
    console.print(table)
    for label, names in sorted(photos.items()):
        few = "" if len(names) >= 3 else " (take at least 3)"
        console.print(f"plate {label}: in {len(names)} photo(s){few}")
    if not table.row_count:
        console.print("found no plate and no sticker")
    return 0


def _shortest_side(detections: Sequence[Detection]) -> float:
    """Return the shortest side of the markers, pixels."""
    import numpy as np

    return min(
        float(np.linalg.norm(np.roll(d.corners, -1, axis=0) - d.corners, axis=1).min())
        for d in detections
    )


def _plates(args: argparse.Namespace) -> int:
    import sys

    from walltopo.reconstruct.scale.plates import BUILT_IN

    sys.stdout.write(BUILT_IN)
    return 0

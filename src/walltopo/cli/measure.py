"""`walltopo measure`: print the plates, find them in photos."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number
from walltopo.cli.outputs import add_overwrite, target

if TYPE_CHECKING:
    from walltopo.reconstruct.scale.markers import Detection


_EPILOG = """\
examples:
  walltopo measure print -o plate.pdf                  an A4 plate
  walltopo measure print -o plate.pdf --paper a3 --number 2
  walltopo measure detect photos/                      which photos show which markers
  walltopo measure plates > plates.toml                the known plates, to add your own to
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add this group's commands."""
    measure = commands.add_parser(
        "measure",
        help="the printed plate that gives a scan its metres, up and floor",
        description="Print the measure, or see where it is found.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    group = measure.add_subparsers(dest="measure_command", required=True, metavar="COMMAND")
    _register_print(group)
    detect = group.add_parser(
        "detect",
        help="which photos show which markers",
        description="Look for the plates' markers in photos, before or without a scan.",
    )
    detect.add_argument("photos", nargs="+", type=Path, metavar="PHOTOS", help="files or folders")
    detect.add_argument("--plates", type=Path, metavar="FILE", help="TOML of other plates")
    detect.set_defaults(run=_detect)
    plates = group.add_parser("plates", help="the TOML of the plates that walltopo knows")
    plates.set_defaults(run=_plates)


def _register_print(group: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    printing = group.add_parser(
        "print",
        help="a plate as a PDF at true size",
        description="Write a plate of four ArUco markers as a PDF to print at 100 %.",
    )
    printing.add_argument("-o", "--out", type=Path, required=True, metavar="FILE", help="the PDF")
    add_overwrite(printing)
    printing.add_argument("--paper", choices=("a4", "a3"), default="a4", help="default: a4")
    printing.add_argument(
        "--number",
        type=Number(int, low=1),
        default=1,
        metavar="N",
        help="which plate of the kind: lay several out with different numbers (default: 1)",
    )
    printing.add_argument("--plates", type=Path, metavar="FILE", help="TOML of your own plates")
    printing.set_defaults(run=_print)


def _print(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import SettingsError
    from walltopo.core.outputs import written_file
    from walltopo.reconstruct.scale.plate_pdf import PAPERS, draw_plate, to_pdf
    from walltopo.reconstruct.scale.plates import built_in_plates, read_plates

    if args.plates:
        kinds = read_plates(args.plates)
    else:
        kinds = [plate for plate in built_in_plates() if plate.name == args.paper]
    if not 1 <= args.number <= len(kinds):
        raise SettingsError(f"--number: expected 1 to {len(kinds)}, got {args.number}")
    plate, paper = kinds[args.number - 1], PAPERS[args.paper]
    pdf = to_pdf(draw_plate(plate, paper), paper, f"walltopo measure {plate.label}")
    with written_file(target(args, args.out, "measure print", inputs=[args.plates])) as temporary:
        temporary.write_bytes(pdf)
    console.print(
        f"{args.out}: plate {plate.label} for {args.paper.upper()}, markers of "
        f"{1000 * plate.marker:g} mm. Print at 100 % and check its ruler."
    )
    return 0


def _detect(args: argparse.Namespace) -> int:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.core import Silent
    from walltopo.reconstruct.scale.plates import built_in_plates, read_plates
    from walltopo.reconstruct.scale.world_frame import detect_in_photos
    from walltopo.scans.photos import PhotoSet

    plates = read_plates(args.plates) if args.plates else built_in_plates()
    table = Table("photo", "plate", "markers", "shortest side")
    photos: dict[str, set[str]] = {}
    for path in args.photos:
        files = sorted(p for p in path.iterdir() if p.is_file()) if path.is_dir() else [path]
        for file in files:
            found = detect_in_photos(PhotoSet(file.parent), [file.name], plates, Silent())
            for plate in plates:
                seen = [d for d in found if d.marker in plate.ids]
                seen = [d for d in seen if d.dictionary == plate.dictionary]
                if seen:
                    photos.setdefault(plate.label, set()).add(file.name)
                    ids = ", ".join(str(d.marker) for d in sorted(seen, key=lambda d: d.marker))
                    table.add_row(file.name, plate.label, ids, f"{_shortest(seen):.0f} px")
    console.print(table)
    for label, names in sorted(photos.items()):
        few = "" if len(names) >= 3 else " (take at least 3)"
        console.print(f"plate {label}: in {len(names)} photo(s){few}")
    if not photos:
        console.print("no plate is seen")
    return 0


def _shortest(detections: Sequence[Detection]) -> float:
    """Shortest side of the markers, pixels."""
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

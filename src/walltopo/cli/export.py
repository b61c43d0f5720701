"""`walltopo export` and `walltopo merge`: a finished scan as other files, scans as one gym."""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.core import InputError

if TYPE_CHECKING:
    from walltopo.scans.folder import ScanFolder

__all__ = ["register"]

EXPORT_EXAMPLES = """\
examples:
  walltopo export gym/ --format glb-web          # small, for the web: meshopt, WebP
  walltopo export gym/ --format obj --route 7    # one boulder alone
  walltopo export gym/ --format usdz --route 7   # the same, to place in a room with an iPhone
  walltopo export gym/ --format labelme -o labels/
"""
MERGE_EXAMPLES = """\
examples:
  walltopo scan left/ -o s1
  walltopo scan right/ -o s2 --reference s1
  walltopo merge s1 s2 -o gym
"""
# As in walltopo.export.convert.FORMATS, which would import NumPy here.
KINDS = ("glb", "glb-web", "usdz", "obj", "ply", "painted-ply", "geojson", "csv", "labelme")


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands."""
    export = commands.add_parser(
        "export",
        help="write a finished scan in another format",
        description="Write the segmented wall of a scan as glTF, USDZ, OBJ, PLY, CSV, GeoJSON or "
        "as LabelMe outlines in its photos.",
        epilog=EXPORT_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    export.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    export.add_argument("--format", choices=KINDS, default="glb", help="default: %(default)s")
    export.add_argument("-o", "--output", type=Path, help="file (labelme: folder) to write")
    part = export.add_mutually_exclusive_group()
    part.add_argument("--route", type=int, metavar="ID", help="one route with the wall around it")
    part.add_argument(
        "--section",
        metavar="FROM:TO",
        help="a stretch of the wall, metres from its left end, such as 2.5:7",
    )
    export.set_defaults(run=_export)
    merge = commands.add_parser(
        "merge",
        help="join aligned scans of a gym's sections into one model",
        description="Join scans that share a frame (made with --reference). Scans are given "
        "oldest first; where two overlap, the newer surface replaces the older.",
        epilog=MERGE_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    merge.add_argument("scans", type=Path, nargs="+", metavar="SCAN", help="oldest first")
    merge.add_argument("-o", "--output", type=Path, required=True, help="folder for the result")
    merge.add_argument(
        "--near",
        type=float,
        default=0.03,
        metavar="M",
        help="metres within which newer surface replaces older (default: %(default)s)",
    )
    merge.add_argument(
        "--same-frame",
        action="store_true",
        help="the scans share a frame although they were not made with --reference",
    )
    merge.set_defaults(run=_merge)


def _section(text: str) -> tuple[float, float]:
    try:
        left, right = (float(word) for word in text.split(":"))
    except ValueError:
        raise InputError(f"--section: expected FROM:TO in metres, got {text!r}") from None
    return left, right


def _export(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.export.convert import FORMATS, convert
    from walltopo.export.crop import crop_route, crop_section
    from walltopo.export.wall import read_wall
    from walltopo.scans.folder import ScanFolder

    scan = ScanFolder(args.scan)
    wall = read_wall(scan)
    name = args.scan.resolve().name
    if args.route is not None:
        wall, name = crop_route(wall, args.route), f"{name}-route-{args.route}"
    if args.section:
        left, right = _section(args.section)
        wall, name = crop_section(wall, left, right), f"{name}-{left:g}-{right:g}"
    suffix = FORMATS[args.format] or f"-{args.format}"
    path = args.output or Path(f"{name}{suffix}")
    convert(wall, args.format, path, scan=scan)
    files = sum(1 for _ in path.iterdir()) if path.is_dir() else 0
    size = f"{files} files" if files else f"{path.stat().st_size / 1e6:.2f} MB"
    what = f"{len(wall.mesh.faces):,} triangles, {len(wall.holds)} holds, {len(wall.routes)} routes"
    console.print(f"{path}: {size} ({what})", markup=False, soft_wrap=True)
    return 0


def _check_frames(scans: list[ScanFolder]) -> None:
    """All but one must have been aligned to a reference, or their frames are unrelated."""
    from walltopo.scans.scale import Scale

    own = [s.root for s in scans if Scale.load(s.scale).method != "reference"]
    if len(own) > 1:
        raise InputError(
            f"{', '.join(str(root) for root in own)}: each has a frame of its own",
            "Scan the later ones again with --reference, or say --same-frame if you know better.",
        )


def _merge(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import Silent
    from walltopo.export.contract import ExportSettings
    from walltopo.export.merge import join_textures, merge_walls
    from walltopo.export.stage import export_wall
    from walltopo.export.wall import read_wall
    from walltopo.scans.artifacts import store_artifact
    from walltopo.scans.folder import ScanFolder
    from walltopo.scans.routes import Routes

    scans = [ScanFolder(path) for path in args.scans]
    if args.output.resolve() in {path.resolve() for path in args.scans}:
        raise InputError(f"{args.output}: the result cannot go into one of the scans")
    if not args.same_frame:
        _check_frames(scans)
    out = ScanFolder(args.output)
    out.root.mkdir(parents=True, exist_ok=True)
    walls = join_textures([read_wall(scan) for scan in scans], out.texture)
    wall = merge_walls(walls, args.near, args.output.resolve().name)
    with tempfile.TemporaryDirectory(prefix=".partial-", dir=out.root) as scratch:
        made = export_wall(wall, ExportSettings(), Path(scratch), Silent())
        for name in ("holds", "glb", "page_assets", "page"):
            store_artifact(out, name, getattr(made, name))
    store_artifact(out, "routes", Routes(routes=tuple(wall.routes)))
    console.print(
        f"{out.page}: {len(wall.holds)} holds, {len(wall.routes)} routes, "
        f"{made.metrics['glb_triangles']:,} triangles; look at it with walltopo view {out.root}",
        markup=False,
        soft_wrap=True,
    )
    return 0

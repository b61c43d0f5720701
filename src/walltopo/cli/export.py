"""`walltopo export` and `walltopo merge`: convert a finished scan, merge scans to one gym."""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number, add_overwrite, output_target
from walltopo.core import InputError

if TYPE_CHECKING:
    from walltopo.scans.folder import ScanFolder


EXPORT_EXAMPLES = """\
examples:
  walltopo export gym/ --format glb-web          # small, for the web: meshopt, WebP
  walltopo export gym/ --format obj --route 7    # one boulder only
  walltopo export gym/ --format usdz --route 7   # the same, to place in a room with an iPhone
  walltopo export gym/ --format csv -o gym.csv   # holds; the routes are in gym.routes.csv
  walltopo export gym/ --format page             # gym.html, self-contained
  walltopo export gym/ --format site -o site/    # for a web host, see docs/viewer.md
  walltopo export gym/ --format labelme -o labels/
  walltopo export gym/ --format tactile --route 7 -o relief/   # to print and touch
"""
MERGE_EXAMPLES = """\
examples:
  walltopo scan left/ -o s1
  walltopo scan right/ -o s2 --reference s1
  walltopo merge s1 s2 -o gym
"""
# As in walltopo.publish.convert.FORMATS, whose import would load NumPy here.
KINDS = (
    "glb", "glb-web", "usdz", "obj", "ply", "painted-ply", "csv", "labelme", "page", "site",
    "tactile",
)  # fmt: skip
WHOLE_MESH = ("glb", "obj", "ply", "painted-ply")  # the others have fewer triangles, or none


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands."""
    export = commands.add_parser(
        "export",
        help="write a finished scan in another format",
        description="Write the segmented wall of a scan as glTF, USDZ, OBJ, PLY, as tables of "
        "holds and routes (CSV), as LabelMe outlines in its photos, or as the page: a single "
        "HTML file to send and open from disk (page), or a folder for any web host (site). One "
        "route can be written for the fingers (tactile): a relief at 1:20 for a 3D printer, and a "
        "drawing for swell paper, both with its name in Braille.",
        epilog=EXPORT_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    export.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    export.add_argument("--format", choices=KINDS, default="glb", help="default: %(default)s")
    export.add_argument(
        "-o", "--output", type=Path, help="file (labelme, site, tactile: folder) to write"
    )
    add_overwrite(export)
    export.add_argument(
        "--route", type=Number(int, low=0), metavar="ID", help="one route with the wall around it"
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
    add_overwrite(merge)
    merge.add_argument(
        "--near",
        type=Number(float, low=0.001, high=1),
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


def _export(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import written_file, written_folder
    from walltopo.publish.convert import FOLDERS, FORMATS, convert, crop_route, one_route
    from walltopo.publish.files.listings import routes_beside
    from walltopo.publish.wall_data import read_wall
    from walltopo.scans.folder import ScanFolder
    from walltopo.scans.holds import count_words

    scan = ScanFolder(args.scan)
    name = args.scan.resolve().name
    if args.route is not None:
        name = f"{name}-route-{args.route}"
    path = args.output or Path(name + (FORMATS[args.format] or f"-{args.format}"))
    output = output_target(args, path, f"export {args.format}")
    with (
        written_folder(output) if args.format in FOLDERS else written_file(output) as made,
        TerminalListener(console) as progress,
    ):
        wall = read_wall(scan)
        if args.route is not None:
            # A relief needs the wall below other holds, to show it without them.
            wall = (one_route if args.format == "tactile" else crop_route)(wall, args.route)
        progress.step(f"write {args.format}")
        convert(wall, args.format, made, scan=scan, progress=progress)
        size = _size_of_output(made)
    what = count_words(len(wall.routes), wall.holds)
    if args.format in WHOLE_MESH:
        what = f"{len(wall.mesh.faces):,} triangles, {what}"
    console.print(f"{path}: {size} ({what})", soft_wrap=True)
    if args.format == "csv":
        console.print(f"{routes_beside(path)}: the routes", soft_wrap=True)
    return 0


def _size_of_output(made: Path) -> str:
    """Return the size of a file, or the number of files and the size of a folder."""
    files = [path for path in made.rglob("*") if path.is_file()] if made.is_dir() else [made]
    count = sum(path.stat().st_size for path in files)
    total = f"{count / 1e6:.2f} MB" if count >= 100_000 else f"{count / 1e3:.1f} kB"
    return f"{len(files)} files, {total}" if made.is_dir() else total


def _check_frames(scans: Sequence[ScanFolder]) -> None:
    """Raise InputError unless all scans share one world frame."""
    from walltopo.scans.folder import world_frame

    override = "use --same-frame if they do share one"
    frames: dict[str, list[str]] = {}
    for scan in scans:
        frames.setdefault(world_frame(scan), []).append(str(scan.root))
    if "" in frames:
        raise InputError(
            f"{', '.join(frames[''])}: aligned by an older version, which did not record the frame",
            f"Align again (`walltopo scan -o {frames[''][0]} --from sparse`), or {override}.",
        )
    if len(frames) > 1:
        raise InputError(
            f"{' | '.join(', '.join(roots) for roots in frames.values())}: each has its own frame",
            f"Scan the later ones again with --reference {scans[0].root}, or {override}.",
        )


def _merge(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import Silent
    from walltopo.core.outputs import written_folder
    from walltopo.publish.merge import join_textures, merge_walls
    from walltopo.publish.outputs import export_wall
    from walltopo.publish.settings import ExportSettings
    from walltopo.publish.wall_data import read_wall
    from walltopo.scans.folder import ScanFolder
    from walltopo.scans.holds import Holds, count_words
    from walltopo.scans.routes import Routes

    scans = [ScanFolder(path) for path in args.scans]
    if not args.same_frame:
        _check_frames(scans)
    with (
        written_folder(output_target(args, args.output, "merge")) as folder,
        tempfile.TemporaryDirectory(prefix=".partial-", dir=folder) as scratch,
    ):
        out = ScanFolder(folder)
        walls = join_textures([read_wall(scan) for scan in scans], out.texture)
        wall = merge_walls(walls, args.near, args.output.resolve().name)
        kept = Path(scratch) / "tiers"
        made = export_wall(wall, ExportSettings(), Path(scratch), Silent(), kept)
        made.glb.save(out.glb)
        made.page_assets.save(out.page_assets)
        made.page.save(out.page)
        Holds(metric=wall.metric, holds=tuple(wall.holds)).save(out.holds)
        Routes(routes=tuple(wall.routes)).save(out.routes)
    page = ScanFolder(args.output).page
    console.print(
        f"{page}: {count_words(len(wall.routes), wall.holds)}, "
        f"{made.metrics['glb_triangles']:,} triangles; open it with "
        f"walltopo view {args.output}",
        soft_wrap=True,
    )
    return 0

"""`walltopo export` and `walltopo merge`: a finished scan as other files, scans as one gym."""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number
from walltopo.cli.outputs import add_overwrite, target
from walltopo.core import InputError, SettingsError

if TYPE_CHECKING:
    from walltopo.scans.folder import ScanFolder


EXPORT_EXAMPLES = """\
examples:
  walltopo export gym/ --format glb-web          # small, for the web: meshopt, WebP
  walltopo export gym/ --format obj --route 7    # one boulder alone
  walltopo export gym/ --format usdz --route 7   # the same, to place in a room with an iPhone
  walltopo export gym/ --format csv -o gym.csv   # holds; gym.routes.csv beside it: routes
  walltopo export gym/ --format page             # gym.html, everything in one file
  walltopo export gym/ --format site -o site/    # for a web host; docs/viewer.md says how
  walltopo export gym/ --format labelme -o labels/
"""
MERGE_EXAMPLES = """\
examples:
  walltopo scan left/ -o s1
  walltopo scan right/ -o s2 --reference s1
  walltopo merge s1 s2 -o gym
"""
# As in walltopo.publish.convert.FORMATS, which would import NumPy here.
KINDS = ("glb", "glb-web", "usdz", "obj", "ply", "painted-ply", "geojson", "csv", "labelme", "page",
         "site")  # fmt: skip
WHOLE_MESH = ("glb", "obj", "ply", "painted-ply")  # the others have fewer triangles, or none


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the commands."""
    export = commands.add_parser(
        "export",
        help="write a finished scan in another format",
        description="Write the segmented wall of a scan as glTF, USDZ, OBJ, PLY, as tables of "
        "holds and routes (CSV; GeoJSON), as LabelMe outlines in its photos, or as the page: one "
        "HTML file to send and open from disk (page), a folder to put on any web host (site).",
        epilog=EXPORT_EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    export.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    export.add_argument("--format", choices=KINDS, default="glb", help="default: %(default)s")
    export.add_argument("-o", "--output", type=Path, help="file (labelme, site: folder) to write")
    add_overwrite(export)
    part = export.add_mutually_exclusive_group()
    part.add_argument(
        "--route", type=Number(int, low=0), metavar="ID", help="one route with the wall around it"
    )
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


def _section(text: str) -> tuple[float, float]:
    try:
        left, right = (float(word) for word in text.split(":"))
    except ValueError:
        raise SettingsError(f"--section: expected FROM:TO in metres, got {text!r}") from None
    if not -math.inf < left < right < math.inf:
        raise SettingsError(f"--section: expected two numbers, the smaller first, got {text!r}")
    return left, right


def _export(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import written_file, written_folder
    from walltopo.publish.convert import FOLDERS, FORMATS, convert, crop_route, crop_section
    from walltopo.publish.files.listings import routes_beside
    from walltopo.publish.wall_data import read_wall
    from walltopo.scans.folder import ScanFolder
    from walltopo.scans.holds import count_words

    scan = ScanFolder(args.scan)
    name, section = args.scan.resolve().name, None
    if args.route is not None:
        name = f"{name}-route-{args.route}"
    if args.section is not None:
        section = _section(args.section)
        name = f"{name}-{section[0]:g}-{section[1]:g}"
    path = args.output or Path(name + (FORMATS[args.format] or f"-{args.format}"))
    place = target(args, path, f"export {args.format}")
    with (
        written_folder(place) if args.format in FOLDERS else written_file(place) as made,
        TerminalListener(console) as progress,
    ):
        wall = read_wall(scan)
        if args.route is not None:
            wall = crop_route(wall, args.route)
        if section is not None:
            wall = crop_section(wall, *section)
        progress.step(f"writing {args.format}")
        convert(wall, args.format, made, scan=scan, progress=progress)
        size = _size(made)
    what = count_words(len(wall.routes), wall.holds)
    if args.format in WHOLE_MESH:
        what = f"{len(wall.mesh.faces):,} triangles, {what}"
    console.print(f"{path}: {size} ({what})", soft_wrap=True)
    if args.format == "csv":
        console.print(f"{routes_beside(path)}: the routes", soft_wrap=True)
    return 0


def _size(made: Path) -> str:
    """Of what lies at a place: a file's bytes, a folder's files."""
    files = [path for path in made.rglob("*") if path.is_file()] if made.is_dir() else [made]
    count = sum(path.stat().st_size for path in files)
    total = f"{count / 1e6:.2f} MB" if count >= 100_000 else f"{count / 1e3:.1f} kB"
    return f"{len(files)} files, {total}" if made.is_dir() else total


def _check_frames(scans: Sequence[ScanFolder]) -> None:
    """All must lie in one world frame, or what they show would be joined at a wrong place."""
    from walltopo.scans.folder import world_frame

    ways = "say --same-frame if you know better"
    frames: dict[str, list[str]] = {}
    for scan in scans:
        frames.setdefault(world_frame(scan), []).append(str(scan.root))
    if "" in frames:
        raise InputError(
            f"{', '.join(frames[''])}: aligned by an older walltopo, which did not note the frame",
            f"Align again (`walltopo scan -o {frames[''][0]} --from sparse`), or {ways}.",
        )
    if len(frames) > 1:
        raise InputError(
            f"{' | '.join(', '.join(roots) for roots in frames.values())}: each has a frame of "
            "its own",
            f"Scan the later ones again with --reference {scans[0].root}, or {ways}.",
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
        written_folder(target(args, args.output, "merge")) as folder,
        tempfile.TemporaryDirectory(prefix=".partial-", dir=folder) as scratch,
    ):
        out = ScanFolder(folder)
        walls = join_textures([read_wall(scan) for scan in scans], out.texture)
        wall = merge_walls(walls, args.near, args.output.resolve().name)
        made = export_wall(wall, ExportSettings(), Path(scratch), Silent())
        made.glb.save(out.glb)
        made.page_assets.save(out.page_assets)
        made.page.save(out.page)
        Holds(metric=wall.metric, holds=tuple(wall.holds)).save(out.holds)
        Routes(routes=tuple(wall.routes)).save(out.routes)
    page = ScanFolder(args.output).page
    console.print(
        f"{page}: {count_words(len(wall.routes), wall.holds)}, "
        f"{made.metrics['glb_triangles']:,} triangles; look at it with "
        f"walltopo view {args.output}",
        soft_wrap=True,
    )
    return 0

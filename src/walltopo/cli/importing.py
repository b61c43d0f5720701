"""`walltopo import`: scan the folder that an app exported."""

from __future__ import annotations

import argparse
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from walltopo.reconstruct.poses.exports import FoundExport

Commands = argparse._SubParsersAction  # argparse has no public name for it

_EPILOG = """\
examples:
  walltopo import auto export/ --dry-run          what is in the folder, and the scan's command
  walltopo import polycam export/ -o wall         photos and poses; stereo makes the mesh
  walltopo import metashape project/ -o wall --with-mesh   its mesh instead of stereo
"""


def register(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "import",
        help="scan the photos, poses and mesh that an app exported",
        description="Say what an app's export holds, and scan it.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "app",
        metavar="APP",
        help="auto, polycam, record3d, scaniverse, realityscan, metashape, nerfstudio or colmap",
    )
    parser.add_argument("folder", type=Path, metavar="FOLDER", help="the exported folder")
    parser.add_argument("-o", "--out", type=Path, metavar="SCAN", help="scan folder")
    parser.add_argument("--photos", type=Path, metavar="FOLDER", help="photos that lie elsewhere")
    parser.add_argument("--with-mesh", action="store_true", help="use the app's mesh, too")
    parser.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="settings of the scan"
    )
    parser.add_argument("--dry-run", action="store_true", help="only say what would be scanned")
    parser.set_defaults(run=_import)


def _import(args: argparse.Namespace) -> int:
    from walltopo.cli import build_parser
    from walltopo.cli.console import console
    from walltopo.core import InputError, SettingsError
    from walltopo.reconstruct.ingest.sources import find_sources, is_video
    from walltopo.reconstruct.poses.exports import APPS, find_poses, read_export

    if args.app not in APPS:
        raise SettingsError(f"unknown app {args.app!r}; known are {', '.join(APPS)}")
    if args.out is None and not args.dry_run:
        raise SettingsError("give -o SCAN, the folder to write, or --dry-run")
    title, poses, photos = find_poses(args.app, args.folder)
    photos = args.photos or photos
    if photos is None:
        raise InputError(f"{poses}: no photos beside these poses", "Name them: --photos FOLDER.")
    files = [file for file in find_sources([photos]).files if not is_video(file)]
    found = read_export(args.folder, title, poses, photos, files)
    mesh = _choose_mesh(found) if args.with_mesh else None
    command = ["scan", str(photos), "-o", str(args.out or "SCAN"), "--poses", str(poses)]
    command += ["--mesh", str(mesh)] if mesh is not None else []
    command += [word for value in args.set for word in ("--set", value)]
    if not args.quiet:
        for line in _describe_export(found, len(files), args.with_mesh):
            console.print(line, soft_wrap=True, highlight=False, markup=False)
        console.print(f"walltopo {shlex.join(command)}", soft_wrap=True, markup=False)
    if args.dry_run:
        return 0
    flags = [flag for flag in ("--quiet", "--verbose") if getattr(args, flag[2:])]
    scan = build_parser().parse_args([*command, *flags])
    code: int = scan.run(scan)
    return code


def _choose_mesh(found: FoundExport) -> Path:
    """Return the only mesh of an export; raise InputError for none or several."""
    from walltopo.core import InputError

    if len(found.meshes) == 1:
        return found.meshes[0]
    if not found.meshes:
        raise InputError(f"{found.poses}: no mesh (OBJ, GLB, PLY) beside these poses")
    names = ", ".join(mesh.name for mesh in found.meshes[:5])
    raise InputError(
        f"{found.meshes[0].parent}: holds several meshes: {names}",
        "Use `walltopo scan PHOTOS --poses PATH --mesh FILE` with one of them.",
    )


def _describe_export(found: FoundExport, photos: int, with_mesh: bool) -> list[str]:
    """Return lines that say what an export holds."""
    given = found.given
    own = ", ".join(mesh.name for mesh in found.meshes[:5]) or "none"
    hint = "" if with_mesh or not found.meshes else " (not used; --with-mesh replaces stereo by it)"
    others = f"; {given.others} more are of other photos" if given.others else ""
    metres = "metres" if given.metric else "any unit: lay a scale plate or give --scale-from"
    return [
        f"format  {found.title}",
        f"photos  {photos} in {found.photos}",
        f"poses   {len(given.photos)} of these photos in {found.poses}{others}",
        f"mesh    {own}{hint}",
        f"unit    {metres}",
        f"up      {'measured by the phone' if given.up else 'unknown: estimated from the cameras'}",
    ]

"""`walltopo mesh`: examine a mesh."""

from __future__ import annotations

import argparse
import json
from pathlib import Path


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add `walltopo mesh check`."""
    group = commands.add_parser("mesh", help="examine meshes", description="Examine meshes.")
    actions = group.add_subparsers(dest="action", required=True, metavar="ACTION")
    check = actions.add_parser(
        "check",
        help="list the defects of a mesh",
        description="List the defects of a mesh: non-manifold edges and vertices, degenerate and "
        "duplicate faces, floaters, normals, edge lengths. Exit code 0: no defects; 1: defects "
        "were found.",
        epilog="example: walltopo mesh check gym/mesh.ply --cameras gym/sparse",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    check.add_argument("file", type=Path, metavar="FILE", help="PLY, OBJ, STL or GLB")
    check.add_argument(
        "--cameras", type=Path, metavar="MODEL", help="COLMAP model, to check the normals' side"
    )
    check.add_argument("--json", action="store_true", help="print JSON")
    check.set_defaults(run=_check)


def _check(args: argparse.Namespace) -> int:
    from rich.text import Text

    from walltopo.cli.console import console
    from walltopo.geometry.mesh_check import check_mesh
    from walltopo.geometry.mesh_files import read_mesh
    from walltopo.scans.colmap_model import read_views

    report = check_mesh(read_mesh(args.file), read_views(args.cameras) if args.cameras else ())
    if args.json:
        console.print_json(json.dumps(report.as_dict()))
        return 1 if report.defects else 0
    facts = report.as_dict()
    facts.pop("problems")
    for name, value in facts.items():
        if value is not None:
            shown = f"{value:.5g}" if isinstance(value, float) else f"{value:,}"
            console.print(f"{name.replace('_', ' '):>24}  {shown}")
    for defect in report.defects:
        console.print(Text.assemble(("problem", "red"), f": {defect}"))
    if not report.defects:
        detail = ": manifold, no degenerate faces, no floaters"
        console.print(Text.assemble(("no problems", "green"), detail))
    return 1 if report.defects else 0

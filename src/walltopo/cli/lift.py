"""`walltopo lift`: lift masks of any objects onto any mesh."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from walltopo.cli.options import Number, add_options, add_overwrite, options_given, output_target
from walltopo.segment.lift.settings import LiftParams

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from walltopo.core import Instances, Mesh, View


EXAMPLES = """\
examples:
  walltopo lift --mesh wall.ply --cameras sparse/ --masks detections.json -o out/
  walltopo lift --mesh coarse.ply --cameras sparse/ --masks ids/ -o out/ --refine-borders 2
  walltopo lift --mesh room.glb --cameras transforms.json --masks ids/ -o out/ --normalised
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "lift",
        help="lift 2D masks of posed photos onto a mesh",
        description="Find the objects that masks in many photos show, and label the mesh's "
        "triangles with them. Writes instances.npz, instances.json and, for inspection, "
        "instances.ply and instances.glb with a colour per instance. Labels are in the order of "
        "the mesh file's faces; for a file of polygons, file_faces.npz has the face of the file "
        "for each triangle.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--mesh", type=Path, required=True, help="triangle mesh (PLY, OBJ, GLB)")
    parser.add_argument(
        "--cameras",
        type=Path,
        required=True,
        help="COLMAP model or project folder, or transforms.json",
    )
    parser.add_argument(
        "--masks", type=Path, required=True, help="COCO file, or folder of PNGs of object numbers"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, help="folder for the results")
    add_overwrite(parser)
    parser.add_argument(
        "--allow-missing",
        action="store_true",
        help="go on if more than half of the photos of the masks have no camera",
    )
    parser.add_argument(
        "--refine-borders",
        type=Number(int, low=0, high=8),
        default=0,
        metavar="N",
        help="also split the triangles at the borders of instances, N times, and write the finer "
        "mesh and its labels to refined/ in the output folder",
    )
    add_options(parser.add_argument_group("settings"), LiftParams)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Read the inputs, lift, write the results and print a summary."""
    params = options_given(args, LiftParams)

    import numpy as np

    from walltopo.cli.console import console
    from walltopo.core.files import atomic_path
    from walltopo.core.outputs import written_folder
    from walltopo.geometry.mesh_files import read_mesh_file, write_ply
    from walltopo.segment.lift import lift
    from walltopo.segment.lift.refine import refine_borders
    from walltopo.segment.lift_files import find_cameras, read_cameras, read_masks
    from walltopo.segment.lift_frames import explain_frames
    from walltopo.segment.lift_matching import attach_masks
    from walltopo.segment.lift_nothing import explain_nothing

    output = output_target(args, args.output, "lift", inputs=(args.mesh, args.cameras, args.masks))
    with written_folder(output) as out:
        masks = read_masks(args.masks)
        cameras, models = find_cameras(args.cameras)
        if cameras != args.cameras:
            choice = f", the largest of {models} models" if models > 1 else ""
            console.print(f"cameras: {cameras}{choice}")
        posed = read_cameras(cameras, masks.sizes)
        matched = attach_masks(posed, masks.masks, allow_missing=args.allow_missing)
        if matched.without_camera:
            console.print(matched.describe_loss())
        views, classes = matched.views, masks.classes
        source = read_mesh_file(args.mesh)
        mesh = source.mesh
        instances = lift(mesh, views, params)
        if not len(instances):
            raise explain_nothing(mesh, views, params)
        if frames := explain_frames(mesh, views, params.seed):
            console.print(f"warning: {frames}")

        _write_lift(out, mesh, instances, views, classes)
        if source.file_face is not None:
            with atomic_path(out / "file_faces.npz") as temporary, temporary.open("wb") as stream:
                np.savez_compressed(stream, file_face=source.file_face)
        if args.refine_borders:
            finer, labels = refine_borders(mesh, views, instances, params, args.refine_borders)
            _write_lift(out / "refined", finer, labels, views, classes)
            write_ply(out / "refined" / "mesh.ply", finer)
    total = sum(len(view.masks) for view in views)
    console.print(
        f"{len(instances)} instances from {total} masks in {len(views)} photos, "
        f"written to {args.output}"
    )
    if args.refine_borders:
        console.print(
            f"{len(mesh.faces)} triangles became {len(finer.faces)} along the borders: "
            f"{args.output / 'refined' / 'mesh.ply'}, with its own instances.npz beside it"
        )
    return 0


def _write_lift(
    folder: Path, mesh: Mesh, found: Instances, views: Sequence[View], classes: Mapping[int, str]
) -> None:
    """Write the labels of a mesh, the instances, and the coloured mesh."""
    from walltopo.segment.lift_files import records_of, table_of, write_coloured

    folder.mkdir(parents=True, exist_ok=True)
    table_of(found).save(folder / "instances.npz")
    records_of(found, views, classes).save(folder / "instances.json")
    write_coloured(folder, mesh, found)

"""`walltopo dataset`: convert, check and split labelled photos, and make them from meshes."""

from __future__ import annotations

import argparse
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from walltopo.cli.options import MAX_SEED, Number, add_needs, add_overwrite, output_target
from walltopo_lab.extras import PLOTS, modules_of

FORMATS = ("coco", "coco-rle", "yolo", "yolo-seg", "labelme", "labelme-embedded", "via")
_SET = "a set: COCO or VIA JSON, LabelMe folder, YOLO folder"

_EPILOG = """\
examples:
  walltopo dataset convert labels.json out/ --to yolo-seg
  walltopo dataset convert boxes/ out/ --to coco --refine grabcut     masks from boxes
  walltopo dataset convert types.json out/ --to yolo --classes "hold=*" volume=Volume
  walltopo dataset show out/ -o sheet.png
  walltopo dataset check boxes/train
  walltopo dataset split out/ parts/ --parts train=0.8,valid=0.2 --pattern "^(gym[a-z]+)"
  walltopo dataset compare mine/ theirs/
  walltopo dataset paint SCAN -o painted.ply            a scan's result, to correct in Blender
  walltopo dataset project painted.ply --scan SCAN -o labels/ --refine grabcut
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `dataset` group of commands."""
    group = commands.add_parser(
        "dataset",
        help="labelled photos: convert, show, split, check, compare, from painted meshes",
        description="Labelled photos: formats, checks, and labels from painted meshes.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    kinds = group.add_subparsers(dest="what", metavar="WHAT", required=True)

    def add(name: str, help: str, run: Any, source: str = "source") -> argparse.ArgumentParser:
        parser = kinds.add_parser(name, help=help, description=help)
        parser.add_argument(source, type=Path, metavar=source.upper(), help=_SET)
        parser.add_argument("--photos", type=Path, metavar="DIR", help="folder of the pictures")
        parser.set_defaults(run=run)
        return parser

    convert = add("convert", "write a set in another format", _convert)
    convert.add_argument("target", type=Path, metavar="DIR", help="where to write")
    convert.add_argument("--to", choices=FORMATS, required=True, help="format")
    convert.add_argument(
        "--classes",
        nargs="+",
        default=[],
        metavar="NEW=OLD,OLD",
        help="other classes: hold=* volume=Volume makes everything else a hold; what is named "
        "nowhere is left out",
    )
    convert.add_argument("--no-photos", action="store_true", help="do not copy the pictures")
    convert.add_argument(
        "--refine", choices=("grabcut", "sam"), help="masks of boxes, or better masks"
    )
    _add_sam(convert)
    show = add("show", "a contact sheet with the labels drawn", _show)
    show.add_argument("-o", "--output", type=Path, required=True, metavar="PNG")
    show.add_argument(
        "--count", type=Number(int, low=1, high=10_000), default=12, help="photos on it (12)"
    )
    show.add_argument("--photo", action="append", default=[], metavar="NAME", help="this photo")
    divide = add("split", "deal photos to parts, whole gyms to one part", _split)
    divide.add_argument("target", type=Path, metavar="DIR", help="a folder per part goes here")
    divide.add_argument("--parts", default="train=0.8,valid=0.2", help="train=0.8,valid=0.2")
    divide.add_argument("--by-gym", action="store_true", help="the default; said for clarity")
    divide.add_argument("--pattern", default="", help="regular expression: gym in the name")
    divide.add_argument("--seed", type=Number(int, low=0, high=MAX_SEED), default=0)
    divide.add_argument("--to", choices=FORMATS, default="coco", help="format (coco)")
    stats = add("stats", "what is in a set", _stats)
    stats.add_argument("-o", "--output", type=Path, metavar="PNG", help="also a chart")
    add_needs(stats, lambda args: PLOTS if args.output else {})
    check = add("check", "faults: boxes outside, empty, twice; labels turned", _check)
    check.add_argument("--no-pictures", action="store_true", help="look at the labels only")
    for parser in (convert, show, divide, stats):
        add_overwrite(parser)
    against = add("compare", "mIoU of a set against a reference", _compare)
    against.add_argument("reference", type=Path, metavar="REFERENCE", help=_SET)
    _register_meshes(kinds)


def _add_sam(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--sam",
        choices=("mobile-sam", "sam-b", "sam2.1-t", "sam2.1-b"),
        default="mobile-sam",
        help="which Segment Anything --refine sam asks (mobile-sam)",
    )
    add_needs(parser, lambda args: modules_of("ultralytics") if args.refine == "sam" else {})


def _register_meshes(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    paint = kinds.add_parser("paint", help="write a scan's result as a painted mesh")
    paint.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    paint.add_argument("-o", "--output", type=Path, required=True, metavar="PLY")
    add_overwrite(paint)
    paint.set_defaults(run=_paint)
    project = kinds.add_parser("project", help="labels of photos from a painted mesh")
    project.add_argument("mesh", type=Path, metavar="MESH", help="painted PLY, OBJ or GLB")
    project.add_argument("--scan", type=Path, metavar="SCAN", help="cameras and photos of a scan")
    project.add_argument("--cameras", type=Path, metavar="DIR", help="a COLMAP model instead")
    project.add_argument("--photos", type=Path, metavar="DIR", help="the pictures, if not SCAN's")
    project.add_argument("--legend", type=Path, metavar="JSON", help="what the colours mean")
    project.add_argument("--split-parts", action="store_true", help="each connected part alone")
    project.add_argument(
        "--min-pixels", type=Number(int, low=1), default=20, help="smaller glimpses go (20)"
    )
    project.add_argument(
        "--refine", choices=("grabcut", "sam"), help="better masks from the pictures"
    )
    _add_sam(project)
    project.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    add_overwrite(project)
    project.set_defaults(run=_project)
    read = kinds.add_parser("unpaint", help="a painted mesh back into a scan's instances")
    read.add_argument("mesh", type=Path, metavar="MESH", help="the corrected painted mesh")
    read.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    read.add_argument("--legend", type=Path, metavar="JSON", help="what the colours mean")
    read.set_defaults(run=_unpaint)


def _refined(dataset: Any, name: str | None, model: str) -> Any:
    if name is None:
        return dataset
    from walltopo.cli.console import console
    from walltopo_lab.datasets.refine import grabcut, refine_dataset

    refiner = grabcut if name == "grabcut" else _sam(model)
    with console.status("refining masks"):
        result, taken = refine_dataset(dataset, refiner)
    total = sum(len(photo.annotations) for photo in result.photos)
    console.print(f"{taken} of {total} masks taken from {name}")
    return result


def _sam(model: str) -> Any:
    """Return a refiner that prompts Segment Anything with each object's box and inner points."""
    import numpy as np

    from walltopo.core import Silent
    from walltopo_lab.datasets.refine import inner_points
    from walltopo_lab.detectors.families import SamMasks
    from walltopo_lab.detectors.fetch import SAM_WEIGHTS, fetch

    sam = SamMasks(fetch(SAM_WEIGHTS[model], Silent()))

    def ask(image: Any, masks: Any, with_points: bool) -> Any:
        boxes = np.array([m.box for m in masks], dtype=np.float64).reshape(-1, 4)
        boxes[:, 2:] += boxes[:, :2]
        scores = np.array([m.score for m in masks], dtype=np.float64)
        labels = np.array([m.label for m in masks], dtype=np.int64)
        points = np.array([inner_points(m) for m in masks]) if with_points else None
        return sam.look(image, boxes, scores, labels, points)

    def refine(image: Any, masks: Any, are_boxes: Any) -> Any:
        answers: list[Any] = [None] * len(masks)
        # The centre of a box may lie off the object, so SAM gets no points for boxes.
        for plain in (True, False):
            mine = [k for k, is_box in enumerate(are_boxes) if bool(is_box) == plain]
            found = ask(image, [masks[k] for k in mine], not plain) if mine else []
            for k, mask in zip(mine, found, strict=True):
                answers[k] = mask
        return answers

    return refine


def _read_set(path: Path, photos: Path | None = None) -> Any:
    """Return a set; name the shapes that were left out."""
    from walltopo.cli.console import console
    from walltopo_lab.datasets.read import read_dataset

    dataset = read_dataset(path, photos)
    if dataset.not_read:
        console.print(f"warning: {path}: shapes left out: {dataset.describe_not_read()}")
    return dataset


def _convert(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.outputs import written_folder
    from walltopo_lab.datasets.read import write_dataset

    output = output_target(
        args,
        args.target,
        f"dataset convert --to {args.to}",
        flag="DIR",
        inputs=(args.source, args.photos),
    )
    with written_folder(output) as made:
        dataset = _read_set(args.source, args.photos)
        if args.classes:
            dataset = dataset.reclassed(_parse_classes(args.classes))
        dataset = _refined(dataset, args.refine, args.sam)
        write_dataset(made, dataset, args.to, copy_photos=not args.no_photos)
    objects = sum(len(photo.annotations) for photo in dataset.photos)
    console.print(f"{len(dataset.photos)} photos, {objects} objects -> {args.target} ({args.to})")
    return 0


def _parse_classes(words: Sequence[str]) -> dict[str, list[str]]:
    """Return `--classes` as new name to old names."""
    from walltopo.core import SettingsError

    pairs = [word.partition("=") for word in words]
    wrong = next((new + sign + old for new, sign, old in pairs if not (new and sign and old)), "")
    if wrong:
        raise SettingsError(f"--classes {wrong}: expected NEW=OLD,OLD")
    return {new: old.split(",") for new, _, old in pairs}


def _show(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.outputs import written_file
    from walltopo_lab.datasets.sheet import write_sheet

    dataset = _read_set(args.source, args.photos)
    output = output_target(args, args.output, "dataset show", inputs=(args.source, args.photos))
    with written_file(output) as made:
        drawn = write_sheet(made, dataset, args.photo, args.count)
    console.print(f"{drawn} photos on {args.output}")
    return 0


def _split(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import SettingsError
    from walltopo.core.outputs import written_folder
    from walltopo_lab.datasets.read import write_dataset
    from walltopo_lab.datasets.split import group_of_photo, split

    try:
        pairs = [part.split("=") for part in args.parts.split(",")]
        shares = {name.strip(): float(share) for name, share in pairs}
    except ValueError as error:
        raise SettingsError(f"--parts {args.parts}: expected name=share,name=share") from error
    for name, share in shares.items():
        if name in ("", ".", "..") or "/" in name or not 0 <= share < math.inf:
            raise SettingsError(
                f"--parts {args.parts}: {name!r} wants the plain name of a folder and a share of 0 "
                "or more"
            )
    dataset = _read_set(args.source, args.photos)
    parts = split(dataset, shares, args.seed, lambda photo: group_of_photo(photo, args.pattern))
    output = output_target(
        args, args.target, "dataset split", flag="DIR", inputs=(args.source, args.photos)
    )
    with written_folder(output) as made:
        for name, part in parts.items():
            write_dataset(made / name, part, args.to)
    for name, part in parts.items():
        gyms = len({group_of_photo(photo, args.pattern) for photo in part.photos})
        objects = sum(len(photo.annotations) for photo in part.photos)
        console.print(f"{name}: {len(part.photos)} photos of {gyms} groups, {objects} objects")
    return 0


def _stats(args: argparse.Namespace) -> int:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.core.outputs import written_file
    from walltopo_lab.datasets.stats import dataset_stats, write_stats_plot

    dataset = _read_set(args.source, args.photos)
    stats = dataset_stats(dataset)
    console.print(
        f"{stats['photos']} photos ({stats['empty_photos']} empty) in {stats['groups']} groups, "
        f"{stats['objects']} objects; per photo (least, median, most) {stats['objects_per_photo']}"
    )
    table = Table("class", "objects", "photos", "with shape", "size px (5, 50, 95 %)")
    for name, row in stats["classes"].items():
        size = ", ".join(f"{v:.0f}" for v in row["size_px"])
        table.add_row(name, *(str(row[k]) for k in ("objects", "photos", "with_shape")), size)
    console.print(table)
    if args.output:
        output = output_target(
            args, args.output, "dataset stats", inputs=(args.source, args.photos)
        )
        with written_file(output) as made:
            write_stats_plot(made, dataset)
    return 0


def _check(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo_lab.datasets.check import check_dataset

    dataset = _read_set(args.source, args.photos)
    with console.status("checking"):
        findings = check_dataset(dataset, pictures=not args.no_pictures)
    for finding in findings:
        where = "" if finding.annotation is None else f" object {finding.annotation}"
        console.print(f"{finding.photo}{where}: {finding.kind}: {finding.text}")
    console.print(f"{len(dataset.photos)} photos, {len(findings)} findings")
    return 1 if findings else 0


def _compare(args: argparse.Namespace) -> int:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo_lab.datasets.compare import compare_sets

    result = compare_sets(_read_set(args.source, args.photos), _read_set(args.reference))
    table = Table("photo", "mIoU")
    for name, value in result.per_photo.items():
        table.add_row(name, f"{value:.3f}")
    console.print(table)
    classes = ", ".join(f"{name} {value:.3f}" for name, value in result.per_class.items())
    console.print(f"mIoU {result.miou:.3f} ({classes}); without wall {result.miou_objects:.3f}")
    console.print(f"mean IoU of the {result.objects} objects {result.instance_iou:.3f}")
    return 0


def _paint(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.outputs import written_file
    from walltopo.geometry.mesh_files import read_mesh
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.datasets.legend import write_legend
    from walltopo_lab.datasets.painted import paint_instances, write_painted
    from walltopo_lab.datasets.scan_labels import read_scan_labels

    scan = ScanFolder(args.scan)
    face_instance, labels, classes = read_scan_labels(scan)
    colours, legend = paint_instances(face_instance, labels, tuple(classes.values()))
    with written_file(output_target(args, args.output, "dataset paint")) as made:
        write_painted(made, read_mesh(scan.mesh), colours)
        write_legend(made.with_suffix(".legend.json"), legend)
    console.print(f"{len(labels)} objects -> {args.output} and its legend")
    return 0


def _legend(args: argparse.Namespace) -> Any:
    from walltopo_lab.datasets.legend import read_legend

    beside = args.mesh.with_suffix(".legend.json")
    path = args.legend or (beside if beside.is_file() else None)
    return read_legend(path) if path else None


def _project(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import SettingsError
    from walltopo.core.outputs import written_folder
    from walltopo.scans.colmap_model import read_views
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.datasets.coco import write_coco
    from walltopo_lab.datasets.painted import read_painted
    from walltopo_lab.datasets.project import project_labels

    if (args.scan is None) == (args.cameras is None):
        raise SettingsError("give either --scan or --cameras")
    scan = ScanFolder(args.scan) if args.scan else None
    cameras = scan.sparse if scan else args.cameras
    photos = args.photos or (scan.photos if scan else None)
    legend = _legend(args)
    painted = read_painted(args.mesh, legend, args.split_parts)
    names = legend.classes if legend else ("hold", "volume")
    with console.status("projecting"):
        dataset = project_labels(
            painted.mesh,
            painted.face_instance,
            painted.labels,
            dict(enumerate(names, start=1)),
            read_views(cameras),
            photos,
            args.min_pixels,
        )
    output = output_target(
        args, args.output, "dataset project", inputs=(args.mesh, cameras, photos, args.legend)
    )
    with written_folder(output) as made:
        dataset = _refined(dataset, args.refine, args.sam)
        write_coco(made / "annotations.json", dataset)
        write_coco(made / "rle" / "annotations.json", dataset, rle=True)
    objects = sum(len(photo.annotations) for photo in dataset.photos)
    console.print(
        f"{len(painted.labels)} objects, {objects} masks in {len(dataset.photos)} photos -> "
        f"{args.output} (polygons; the same with RLE in rle/)",
    )
    return 0


def _unpaint(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.datasets.painted import read_painted
    from walltopo_lab.datasets.scan_labels import write_scan_labels

    painted = read_painted(args.mesh, _legend(args))
    kept = write_scan_labels(ScanFolder(args.scan), painted)
    console.print(f"{kept} objects written into {args.scan}")
    return 0

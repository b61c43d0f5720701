"""`walltopo evaluate`: metrics of scans, lifts, detectors and clips against ground truth."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from walltopo.cli.options import Number, add_needs, add_overwrite, output_target
from walltopo_lab.extras import LEARN, PLOTS

_SCAN_EPILOG = """\
examples:
  walltopo evaluate scan wall --truth gym-a            a metric scan: fits heading and place
  walltopo evaluate scan wall --truth gym-a --align    also fits scale, to the true cameras
"""
_INSTANCES_EPILOG = """\
example:
  walltopo evaluate instances out/instances.npz --truth gym-a/lift
"""
_DETECTOR_EPILOG = """\
examples:
  walltopo evaluate detector detections.json --truth hold-masks/annotations.json
  walltopo evaluate detector detections.json --truth hold-boxes/valid -o figures
"""
_BETA_EPILOG = """\
example:
  walltopo film gym3 -o clips --count 12
  walltopo evaluate beta clips --scan wall --truth gym3 -o beta.json
"""
_LOOSE_EPILOG = """\
example:
  walltopo synth gym3-later --wear-of gym3 --wear-seed 9
  walltopo scan gym3-later/photos -o wall-later --reference wall
  walltopo evaluate loose wall wall-later --truth gym3 gym3-later
"""

# section, key, label in the table, unit
_ROWS = (
    ("poses", "registered", "photos registered", ""),
    ("poses", "centre_median_mm", "camera centres, median", "mm"),
    ("poses", "centre_max_mm", "camera centres, worst", "mm"),
    ("poses", "rotation_median_deg", "camera rotations, median", "°"),
    ("poses", "scale_error_percent", "scale error", "%"),
    ("poses", "up_error_deg", "up error", "°"),
    ("poses", "floor_error_mm", "floor error", "mm"),
    ("mesh", "accuracy_8mm", "mesh within 8 mm of truth", ""),
    ("mesh", "accuracy_90_mm", "90 % of the mesh within", "mm"),
    ("mesh", "completeness_10mm", "truth within 10 mm of mesh", ""),
    ("mesh", "holds_present", "holds over 5 cm present", ""),
    ("mesh", "holds_over_5cm", "  of", ""),
    ("shown", "shown", "instances shown", ""),
    ("shown", "truth", "  true", ""),
    ("shown", "hits", "  met at IoU .5", ""),
    ("shown", "precision", "precision of what is shown", ""),
    ("shown", "recall", "recall of what is shown", ""),
    ("semantics", "miou", "semantic mIoU of what is shown", ""),
    ("semantics", "miou_objects", "  without wall", ""),
    ("semantics_on_true_mesh", "miou", "  on the true mesh", ""),
    ("semantics_all", "miou", "semantic mIoU of all instances", ""),
    ("attributes", "colour_accuracy", "colours right", ""),
    ("attributes", "both_colours", "  both of two-coloured holds", ""),
    ("attributes", "called_two_coloured", "  others called two-coloured", ""),
    ("attributes", "type_named", "holds with a type", ""),
    ("attributes", "type_accuracy", "  of these right", ""),
    ("routes", "ari", "routes, ARI", ""),
    ("routes", "homogeneity", "routes, homogeneity", ""),
    ("routes", "completeness", "routes, completeness", ""),
    ("routes", "holds_compared", "holds compared", ""),
    ("routes", "routes_found", "routes found", ""),
    ("routes", "routes_true", "  true", ""),
)
_AP = (("ap", "AP"), ("ap50", "AP50"), ("ap25", "AP25"), ("coco_ap", "AP .50:.95"))


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `evaluate` group of commands."""
    group = commands.add_parser("evaluate", help="figures against truth")
    kinds = group.add_subparsers(dest="kind", metavar="WHAT", required=True)
    raw = argparse.RawDescriptionHelpFormatter
    scan = kinds.add_parser(
        "scan",
        help="a scan folder against ground truth",
        description="Compare a scan with ground truth (gt.npz and scene.json): cameras, mesh, "
        "instances, semantics, colours and routes. The APs rank every instance that the lift "
        "found; all else is of the instances that the scan shows as holds, without the doubtful. "
        "Writes evaluation.json and a mesh that shows hits, misses, false ones and border errors "
        "in four colours (errors.glb, errors.ply).",
        epilog=_SCAN_EPILOG,
        formatter_class=raw,
    )
    scan.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    scan.add_argument("--truth", type=Path, required=True, metavar="DIR", help="ground truth")
    scan.add_argument(
        "--align", action="store_true", help="also fit scale and tilt to the true camera centres"
    )
    scan.add_argument(
        "--distance",
        type=Number(float, low=0, high=10),
        default=0.02,
        help="carry labels this far, metres (0.02)",
    )
    scan.add_argument("-o", "--output", type=Path, metavar="DIR", help="default: SCAN/evaluation")
    add_overwrite(scan)
    scan.set_defaults(run=_evaluate_scan)
    add_needs(scan, LEARN)
    instances = kinds.add_parser(
        "instances",
        help="3D instances against truth on the same mesh",
        description="AP of instances.npz (with instances.json beside it) on the mesh of the truth.",
        epilog=_INSTANCES_EPILOG,
        formatter_class=raw,
    )
    instances.add_argument("instances", type=Path, metavar="NPZ", help="instances.npz")
    instances.add_argument("--truth", type=Path, required=True, metavar="DIR", help="ground truth")
    instances.add_argument("-o", "--output", type=Path, metavar="JSON", help="write the figures")
    add_overwrite(instances)
    instances.set_defaults(run=_evaluate_instances)
    detector = kinds.add_parser(
        "detector",
        help="2D detections against labelled photos",
        description="COCO figures of boxes, and of masks where the truth has them.",
        epilog=_DETECTOR_EPILOG,
        formatter_class=raw,
    )
    detector.add_argument("detections", type=Path, metavar="JSON", help="detections.json (COCO)")
    detector.add_argument(
        "--truth", type=Path, required=True, metavar="DATASET", help="a labelled set, any format"
    )
    detector.add_argument(
        "-o", "--output", type=Path, metavar="DIR", help="write figures.json and curves (PNG)"
    )
    add_overwrite(detector)
    detector.set_defaults(run=_evaluate_detector)
    add_needs(detector, lambda args: PLOTS if args.output else {})
    beta = kinds.add_parser(
        "beta",
        help="clips of `walltopo film`, read against a scan of their gym",
        description="Read each clip as a climber's, its route unknown, and compare with its truth: "
        "camera, contacts of hands and feet, route, top. A contact is right if the same limb takes "
        "the same hold within half a second.",
        epilog=_BETA_EPILOG,
        formatter_class=raw,
    )
    beta.add_argument("clips", type=Path, metavar="CLIPS", help="a folder of `walltopo film`")
    beta.add_argument(
        "--scan", type=Path, required=True, metavar="SCAN", help="a scan of the gym's photos"
    )
    beta.add_argument(
        "--truth", type=Path, required=True, metavar="GYM", help="the folder of `walltopo synth`"
    )
    beta.add_argument("-o", "--output", type=Path, metavar="JSON", help="write the figures")
    add_overwrite(beta)
    beta.set_defaults(run=_evaluate_beta)
    loose = kinds.add_parser(
        "loose",
        help="holds that turned, moved or are gone between two scans of a worn gym",
        description="Compare two scans hold by hold, as `walltopo inventory --since --loose` does, "
        "and count what was found of the gym's wear.",
        epilog=_LOOSE_EPILOG,
        formatter_class=raw,
    )
    loose.add_argument("scans", type=Path, nargs=2, metavar="SCAN", help="before and after")
    loose.add_argument(
        "--truth", type=Path, nargs=2, required=True, metavar="GYM", help="before and after"
    )
    loose.add_argument("-o", "--output", type=Path, metavar="JSON", help="write the figures")
    add_overwrite(loose)
    loose.set_defaults(run=_evaluate_loose)


def _evaluate_scan(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.files import write_json
    from walltopo.core.outputs import written_folder
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.evaluate.errors_mesh import write_errors
    from walltopo_lab.evaluate.scan import evaluate_scan, is_metric
    from walltopo_lab.evaluate.truth import read_truth

    scan, truth = ScanFolder(args.scan), read_truth(args.truth)
    metric = is_metric(scan)
    if not metric and not args.align:
        console.print("the scan is not in metres: fitting scale to the true cameras (--align)")
    fits = [False] if metric else []
    fits += [True] if args.align or not metric else []
    folder = args.output or scan.root / "evaluation"
    results = []
    output = output_target(args, folder, "evaluate scan", inputs=[args.truth])
    with written_folder(output) as made:
        with console.status("comparing with truth"):
            for similarity in fits:
                results.append(
                    evaluate_scan(scan, truth, similarity=similarity, within=args.distance)
                )
        console.print(scan_table([result.figures for result in results]))
        write_json(
            made / "evaluation.json",
            {
                "version": 1,
                "distance_m": args.distance,
                "fits": [result.figures for result in results],
            },
        )
        errors = results[-1].errors
        if errors is not None:
            write_errors(errors, made)
    if errors is not None:
        console.print(
            "errors.glb: [rgb(0,158,115)]hit[/], [rgb(0,114,178)]missed[/], "
            "[rgb(213,94,0)]false[/], [rgb(240,228,66)]border[/]",
            markup=True,
        )
    console.print(f"wrote {folder}")
    return 0


def scan_table(fits: list[dict[str, Any]]) -> Any:
    """Return a table with one row per metric and one column per fit."""
    from rich.table import Table

    table = Table("figure", *[str(f["fit"]) for f in fits], title="scan against truth")
    for section, key, label, unit in _ROWS:
        if any(key in f.get(section, {}) for f in fits):
            table.add_row(label, *[_text(f.get(section, {}).get(key), unit) for f in fits])
    table.add_section()
    for section, where in (("instances", ""), ("instances_on_true_mesh", " on the true mesh")):
        for part, name in (("agnostic", "one class"), ("mean", "mean of classes")):
            rows = [f.get(section, {}).get(part) for f in fits]
            if any(rows):
                cells = [" / ".join(_text((r or {}).get(key), "") for key, _ in _AP) for r in rows]
                table.add_row(f"AP of all instances{where}, {name}", *cells)
    table.caption = "AP, ranked by score: " + " / ".join(label for _, label in _AP)
    return table


def _text(value: Any, unit: str) -> str:
    if value is None:
        return "-"
    return f"{value:.3g} {unit}".strip() if unit else f"{value:.3f}" if _real(value) else f"{value}"


def _real(value: Any) -> bool:
    return isinstance(value, float)


def _evaluate_instances(args: argparse.Namespace) -> int:
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.core.files import write_json
    from walltopo.core.outputs import written_file
    from walltopo_lab.evaluate.instances import evaluate_instances
    from walltopo_lab.evaluate.scan import read_labelled
    from walltopo_lab.evaluate.truth import read_truth

    truth = read_truth(args.truth)
    predicted = read_labelled(args.instances, args.instances.with_suffix(".json"))
    metrics = evaluate_instances(predicted, truth.labelled, truth.mesh.areas, truth.ignored)
    table = Table("", *[label for _, label in _AP], "true", "found", title="3D instances")
    rows: Mapping[str, Any] = {
        "one class": metrics.agnostic,
        "mean of classes": metrics.mean,
        **{f"class {label}": part for label, part in metrics.per_class.items()},
    }
    for name, part in rows.items():
        values = part.as_dict()
        cells = [_text(values[key], "") for key, _ in _AP]
        table.add_row(name, *cells, str(part.truth), str(part.predicted))
    console.print(table)
    if args.output:
        inputs = (args.instances, args.truth)
        with written_file(
            output_target(args, args.output, "evaluate instances", inputs=inputs)
        ) as made:
            write_json(made, metrics.as_dict())
    return 0


def _evaluate_detector(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core.files import write_json
    from walltopo.core.outputs import written_folder
    from walltopo_lab.datasets.read import read_dataset
    from walltopo_lab.evaluate.detector import evaluate_detections, figures_table
    from walltopo_lab.evaluate.detector_plot import write_curves

    result = evaluate_detections(read_dataset(args.detections), read_dataset(args.truth))
    console.print(figures_table(result))
    if args.output:
        inputs = (args.detections, args.truth)
        with written_folder(
            output_target(args, args.output, "evaluate detector", inputs=inputs)
        ) as made:
            write_json(made / "figures.json", result.as_dict())
            curves = [path.name for path in write_curves(result, made)]
        for name in curves:
            console.print(f"wrote {args.output / name}")
    return 0


def _evaluate_beta(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.scans.folder import ScanFolder
    from walltopo_lab.evaluate.beta import BetaFigures, KnownWall, evaluate_clip, figures_row
    from walltopo_lab.synth.filmed import read_clips

    clips = read_clips(args.clips)
    with (
        _figures_file(args, "evaluate beta", args.clips, args.truth) as write,
        TerminalListener(console) as listener,
    ):
        listener.step("reading the scan")
        wall = KnownWall.match(ScanFolder(args.scan), args.truth)
        listener.step("reading clips", len(clips))
        results = []
        for video, truth in clips:
            results.append(evaluate_clip(video, truth, wall))
            listener.note(figures_row(results[-1]))
            listener.advance()
        write(BetaFigures(tuple(results)).as_dict())
    return 0


def _evaluate_loose(args: argparse.Namespace) -> int:
    from walltopo_lab.evaluate.loose import compare_scans, loose_figures

    with _figures_file(args, "evaluate loose", *args.scans, *args.truth) as write:
        write(loose_figures(compare_scans(*args.scans, *args.truth)))
    return 0


@contextmanager
def _figures_file(
    args: argparse.Namespace, command: str, *inputs: Path
) -> Iterator[Callable[[Mapping[str, Any]], None]]:
    """Yield a function that prints figures and writes them to `--output`.

    The output is checked before the block, because figures take long.
    """
    from walltopo.cli.console import console
    from walltopo.core.files import write_json
    from walltopo.core.outputs import written_file

    with ExitStack() as stack:
        made = None
        if args.output is not None:
            target = output_target(args, args.output, command, inputs=inputs)
            made = stack.enter_context(written_file(target))

        def write(figures: Mapping[str, Any]) -> None:
            if made is not None:
                write_json(made, figures)
            for name, value in figures.items():
                console.print(f"{name}: {value}", soft_wrap=True)

        yield write

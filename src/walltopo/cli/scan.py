"""`walltopo scan` and `walltopo settings`: run the pipeline, and list its settings."""

from __future__ import annotations

import argparse
import json
from contextlib import ExitStack
from pathlib import Path

Commands = argparse._SubParsersAction  # argparse has no public name for it

STAGE_LIST = "ingest, sparse, scale, dense, texture, detect, lift, classify, routes, export"

_SCAN_EPILOG = f"""\
stages: {STAGE_LIST}

examples:
  walltopo scan photos/ -o wall                  photos of a wall with a printed scale plate
  walltopo scan visit.mp4 -o wall                a video instead
  walltopo scan photos/ -o wall --to dense       stop after the mesh
  walltopo scan -o wall --from lift --set lift.threshold=0.4   redo from the lift on
  walltopo scan more/ -o wall --add              further photos of the same wall
  walltopo scan new/ -o wall2 --reference wall   after a reset, in the old scan's frame
  walltopo scan left/ -o wall3 --reference wall2 --part   only what changed; the rest stays
  walltopo scan red/ -o wall4 --reference wall3 --part --colour red   only the red holds

Run the same command again after a failure or Ctrl-C: finished work is kept.
"""


def register(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add this group's commands."""
    _register_scan(commands)
    settings = commands.add_parser("settings", help="list all settings and defaults as TOML")
    settings.add_argument("section", nargs="?", default="", help="only this section, e.g. lift")
    settings.add_argument("--all", action="store_true", help="include expert settings")
    settings.add_argument("--markdown", action="store_true", help="print the table of the docs")
    settings.set_defaults(run=_settings)


def _register_scan(commands: Commands[argparse.ArgumentParser]) -> None:
    scan = commands.add_parser(
        "scan",
        help="make a segmented wall with routes from photos",
        description="Run the stages that are missing or out of date, from photos to the page.",
        epilog=_SCAN_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    scan.add_argument(
        "photos", nargs="*", type=Path, metavar="PHOTOS", help="folder, photos, video"
    )
    scan.add_argument("-o", "--out", type=Path, required=True, metavar="SCAN", help="scan folder")
    scan.add_argument("--add", action="store_true", help="PHOTOS come to those that the scan has")
    scan.add_argument("--config", type=Path, metavar="FILE", help="settings file (walltopo.toml)")
    scan.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", help="e.g. lift.threshold=0.4"
    )
    scan.add_argument("--from", dest="from_stage", metavar="STAGE", help="redo from this stage on")
    scan.add_argument("--to", dest="to_stage", metavar="STAGE", help="stop after this stage")
    scan.add_argument("--force", action="store_true", help="redo every stage")
    scan.add_argument(
        "--verify", action="store_true", help="read every file of the scan to find damage"
    )
    scan.add_argument(
        "--accept-changes",
        action="store_true",
        help="accept files of the scan that you changed",
    )
    scan.add_argument(
        "--scale-from", metavar="A-B=METRES", help="distance of two photos or named points"
    )
    scan.add_argument("--reference", type=Path, metavar="SCAN", help="align into this scan")
    scan.add_argument(
        "--part", action="store_true", help="the photos show a part of the reference's wall"
    )
    scan.add_argument(
        "--colour",
        action="append",
        metavar="NAME",
        help="with --part: exchange only holds of this colour (repeatable)",
    )
    scan.add_argument(
        "--poses", type=Path, metavar="PATH", help="camera poses of a phone or another program"
    )
    scan.add_argument(
        "--mesh", type=Path, metavar="FILE", help="ready mesh in the frame of --poses"
    )
    scan.add_argument("--align", metavar="HOW", help="constrained (default) or rigid")
    scan.add_argument(
        "--dense",
        metavar="BACKEND",
        help="auto, sgm, colmap, openmvs, sparse or a plug-in's",
    )
    scan.add_argument("--model", metavar="NAME|FILE", help="the detector")
    scan.add_argument(
        "--profile", type=Path, metavar="FILE", help="write a trace for ui.perfetto.dev (.json)"
    )
    scan.add_argument("-v", "--verbose", action="store_true", help="more detail")
    scan.add_argument("-q", "--quiet", action="store_true", help="errors only")
    scan.set_defaults(run=_scan)


def _scan(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.profiling import ProfiledListener, trace_threads
    from walltopo.pipeline.runner import scan
    from walltopo.pipeline.settings import load_settings

    found = Path("walltopo.toml")
    config = args.config or (found if found.is_file() else None)
    given = [*_settings_of_options(args), *args.set]
    settings = load_settings(config, given, programs=args.config is not None)
    with ExitStack() as stack:
        listener = ProfiledListener(console, verbose=args.verbose, quiet=args.quiet)
        listener.tracer = stack.enter_context(trace_threads(args.profile))
        stack.enter_context(listener)
        result = scan(
            args.photos,
            args.out,
            settings,
            add=args.add,
            from_stage=args.from_stage,
            to_stage=args.to_stage,
            force=args.force,
            verify=args.verify,
            accept_changes=args.accept_changes,
            listener=listener,
        )
    if not args.quiet and result.folder.routes.exists() and args.to_stage in (None, "export"):
        _show_result(result.folder.root)
    return 0


def _settings_of_options(args: argparse.Namespace) -> list[str]:
    """Return the settings of short options."""
    pairs = {
        "scale.distance": args.scale_from,
        "sparse.reference": args.reference.absolute() if args.reference else None,
        "sparse.part_colours": ",".join(args.colour) if args.colour else None,
        "sparse.poses": args.poses.absolute() if args.poses else None,
        "dense.mesh": args.mesh.absolute() if args.mesh else None,
        "sparse.align": args.align,
        "dense.backend": args.dense,
        "detect.model": args.model,
    }
    # JSON strings are valid TOML.
    given = [
        f"{key}={json.dumps(str(v), ensure_ascii=False)}"
        for key, v in pairs.items()
        if v is not None
    ]
    return [*given, "sparse.part=true"] if args.part else given


def _show_result(root: Path) -> None:
    """Print the table of routes, and the page to open."""
    from rich.table import Table

    from walltopo.cli.console import console
    from walltopo.scans.folder import ScanFolder
    from walltopo.scans.holds import Holds, count_words, steepness_words
    from walltopo.scans.routes import Routes, route_name

    folder = ScanFolder(root)
    routes, holds = Routes.load(folder.routes).routes, Holds.load(folder.holds)
    metric = holds.metric
    unit = "m" if metric else "units"
    table = Table(title=count_words(len(routes), holds.holds), title_justify="left")
    table.add_column("id", justify="right")
    table.add_column("route", overflow="fold")
    table.add_column("colour")
    for column in ("holds", f"length [{unit}]", "steepness"):
        table.add_column(column, justify="right")
    for route in routes:
        table.add_row(
            str(route.id),
            route_name(route),
            route.colour,
            str(len(route.holds)),
            f"{route.length:.2f}",
            steepness_words(route.steepness_deg),
        )
    console.print(table)
    if not metric:
        console.print("found no scale plate: lengths are in arbitrary units", style="yellow")
    console.print(f"open {folder.page.absolute()}", soft_wrap=True)
    console.print(f"or   walltopo view {root}", soft_wrap=True)


def _settings(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.core import SettingsError
    from walltopo.pipeline.settings import SECTIONS, allowed, sections, settings_markdown

    if args.section and args.section not in SECTIONS:
        raise SettingsError(f"no section {args.section!r}; expected one of {', '.join(SECTIONS)}")
    if args.markdown:
        console.print(settings_markdown(), soft_wrap=True, end="")
        return 0
    for section, fields in sections().items():
        if args.section not in ("", section):
            continue
        console.print(f"\n[{section}]", style="bold")
        for field in fields.values():
            if field.expert and not args.all:
                continue
            facts = "; ".join(part for part in (field.text, field.unit, allowed(field)) if part)
            line = f"{field.name} = {_toml_value(field.default)}"
            console.print(f"{line:<36} # {facts}", soft_wrap=True)
    return 0


def _toml_value(value: object) -> str:
    """Return a default value in TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float)):
        return str(value)
    if isinstance(value, (tuple, list)):
        return "[" + ", ".join(map(_toml_value, value)) + "]"
    return '"' + str(value).replace("\\", "\\\\").replace('"', '\\"') + '"'

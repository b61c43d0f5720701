"""`walltopo inventory`: list the holds on a wall, and the changes since another scan."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walltopo.cli.options import add_overwrite, output_target

if TYPE_CHECKING:
    from walltopo.describe.matching.inventory import ScanHolds
    from walltopo.describe.matching.motions import Motions

_EXAMPLE = """examples:
  walltopo inventory gym3
  walltopo inventory gym3 --since gym3-march --changed
  walltopo inventory gym3 --since gym3-march --loose
  walltopo inventory gym3 --format csv --out holds.csv
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `inventory` command."""
    parser = commands.add_parser(
        "inventory",
        help="count holds by colour, type and size; compare two scans of a wall",
        description="Count the holds of a scan by role, colour, type and size. With --since: "
        "list the changes since an older scan of the same wall (matched by position and shape; "
        "both scans must share a frame, from `--reference` or scale plates at the same place).",
        epilog=_EXAMPLE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("scan", type=Path, help="scan folder")
    parser.add_argument("--since", type=Path, metavar="OLD", help="an older scan of the wall")
    parser.add_argument("--changed", action="store_true", help="with --since: omit unchanged holds")
    parser.add_argument(
        "--loose",
        action="store_true",
        help="with --since: also look for holds that turned or moved, by their looks",
    )
    parser.add_argument("--format", choices=("table", "csv", "json"), default="table")
    parser.add_argument("--out", type=Path, help="write to this file instead of the terminal")
    add_overwrite(parser)
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Print or write the inventory; exit code 0."""
    from walltopo.core import SettingsError
    from walltopo.describe.matching.inventory import changes, count_holds, load_scan, wall_area

    for flag in ("changed", "loose"):
        if getattr(args, flag) and args.since is None:
            raise SettingsError(f"--{flag} needs --since OLD")
    new = load_scan(args.scan)
    scan, holds, metric, unit = new
    if args.since is None:
        rows = [row.to_json() for row in count_holds(holds, unit)]
        area = wall_area(scan)
        area_unit = "m²" if metric else "square scan units (the scan has no scale)"
        summary = f"{len(holds)} instances on {area:.1f} {area_unit} of mesh"
        return _emit(args, rows, {"holds": len(holds), "area_m2": round(area, 3)}, summary)
    before = load_scan(args.since)
    motions = _motions_between(before, new) if args.loose else None
    found = changes(before.holds, holds, unit, motions)
    kinds = ("came", "went", *(("turned", "moved") if args.loose else ()), "recoloured", "stayed")
    counts = dict.fromkeys(kinds, 0)
    for change in found:
        counts[change.what] += 1
    rows = [c.to_json() for c in found if not (args.changed and c.what == "stayed")]
    return _emit(args, rows, counts, ", ".join(f"{n} {what}" for what, n in counts.items()))


def _motions_between(old: ScanHolds, new: ScanHolds) -> Motions:
    """Return the motions of the holds of two scans."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.describe.matching.motions import find_motions
    from walltopo.describe.matching.patches import read_textured_wall

    walls = [read_textured_wall(one.folder, one.unit) for one in (old, new)]
    with TerminalListener(console) as listener:
        return find_motions(walls[0], walls[1], old.holds, new.holds, listener)


def _emit(
    args: argparse.Namespace, rows: list[dict[str, Any]], totals: dict[str, Any], summary: str
) -> int:
    import json

    from walltopo.cli.console import console
    from walltopo.core.outputs import written_file
    from walltopo.describe.matching.inventory import to_csv

    if args.format == "table" and args.out is None:
        console.print(_table(rows))
        console.print(summary)
        return 0
    if args.format == "json":
        text = json.dumps({"version": 1, "totals": totals, "rows": rows}, indent=1) + "\n"
    else:
        text = to_csv(rows)
    if args.out is None:
        console.out(text, end="", highlight=False)
    else:
        with written_file(output_target(args, args.out, "inventory", flag="--out")) as temporary:
            temporary.write_text(text, encoding="utf-8")
        console.print(f"{args.out}: {summary}")
    return 0


def _table(rows: list[dict[str, Any]]) -> Any:
    from rich.table import Table

    table = Table()
    for name in rows[0] if rows else ("nothing",):
        table.add_column(name)
    for row in rows:
        table.add_row(*("" if value is None else str(value) for value in row.values()))
    return table

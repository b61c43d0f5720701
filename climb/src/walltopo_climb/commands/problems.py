"""`walltopo problem` and `walltopo ease`: propose new problems, and adjust a route's grade."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from walltopo.cli.options import Number
from walltopo_climb.commands.moves import climbers_summary

if TYPE_CHECKING:
    from collections.abc import Sequence

    from walltopo.scans.edits import Edit
    from walltopo_climb.problems.rows import Proposals, Tweaks
    from walltopo_climb.problems.wall import SetWall


_PROBLEM = """examples:
  walltopo problem gym3 --grade 6B-6C
  walltopo problem gym3 --grade 7A --moves 8 --steepness overhang --holds slopers --seed 4
  walltopo problem gym3 --grade 6B --height 1.45 --reach static --put 1    onto the wall
"""
_EASE = """examples:
  walltopo ease gym3 4               one grade easier: which hold to add to route 4
  walltopo ease gym3 4 --harder      which hold to remove
  walltopo ease gym3 4 --put 1       apply the first change
"""
# The ways in which a proposal may differ from its specification, as people read them.
_VIOLATIONS = {
    "grade": "the middle of the range is not within the requested grade",
    "easy": "easier than all training data: the range is open below",
    "moves": "a different number of moves",
    "steepness": "most of the holds are on walls of another steepness",
    "holds": "most of the holds are of another kind",
    "reach": "the reach is not as requested",
    "body": "the requested body must leap or does not reach the top",
}

Commands = argparse._SubParsersAction  # argparse has no public name for it


def register_problem(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo problem`."""
    problem = commands.add_parser(
        "problem",
        help="propose new problems on the current holds",
        description="Search the holds of a scan for problems of a given grade, length and style. "
        "The holds stay on their routes. --put adds one as a route of the scan, marked as "
        "proposed: climb it before you trust it.",
        epilog=_PROBLEM,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    problem.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    problem.add_argument(
        "--grade", required=True, metavar="GRADE", help="a grade or a range: 6B, 6B-6C, V4"
    )
    problem.add_argument(
        "--moves", type=Number(int, 2, 16), default=6, help="number of hand moves (default: 6)"
    )
    problem.add_argument(
        "--steepness", choices=("any", "slab", "vertical", "overhang", "steep"), default="any"
    )
    problem.add_argument(
        "--reach", choices=("any", "static", "dynamic"), default="any", help="without or with leaps"
    )
    problem.add_argument(
        "--holds",
        choices=("any", "jugs", "crimps", "slopers", "pinches", "pockets", "small", "large"),
        default="any",
    )
    problem.add_argument(
        "--height",
        type=Number(float, 0.9, 2.3),
        default=1.75,
        metavar="M",
        help="of a body that must also be able to climb it [m] (default: 1.75)",
    )
    problem.add_argument(
        "--span", type=Number(float, 0.7, 2.8), default=0.0, metavar="M", help="its arm span [m]"
    )
    problem.add_argument(
        "--count", type=Number(int, 1, 8), default=3, help="number of proposals (default: 3)"
    )
    problem.add_argument("--seed", type=Number(int, 0, 2**31 - 1), default=0, help="random seed")
    _add_output_options(problem, "add the proposal with this number as a route of the scan")
    problem.set_defaults(run=_problem)


def register_ease(commands: Commands[argparse.ArgumentParser]) -> None:
    """Add `walltopo ease`."""
    easier = commands.add_parser(
        "ease",
        help="find the hold that makes a route one grade easier, or harder",
        description="Find the holds near a route that would make it about one grade easier (or "
        "those to remove to make it harder), and the effect on its hardest move.",
        epilog=_EASE,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    easier.add_argument("scan", type=Path, metavar="SCAN", help="the scan folder")
    easier.add_argument("route", type=Number(int, 1), metavar="ROUTE", help="its number")
    easier.add_argument("--harder", action="store_true", help="one grade harder")
    _add_output_options(easier, "apply the change with this number")
    easier.set_defaults(run=_adjust_grade)


def _add_output_options(command: argparse.ArgumentParser, text: str) -> None:
    command.add_argument("--put", type=Number(int, 1), metavar="N", help=f"{text}, as an edit")
    command.add_argument("--format", choices=("table", "json"), default="table")


def _problem(args: argparse.Namespace) -> int:
    import msgspec

    from walltopo_climb.problems.edit_entries import problem_entry
    from walltopo_climb.problems.spec import ProblemSpec

    given = {
        name: getattr(args, name)
        for name in ("grade", "moves", "steepness", "reach", "holds", "count", "seed")
    }
    spec = msgspec.convert(given | {"height_m": args.height, "span_m": args.span}, ProblemSpec)
    wall = _read_wall(args.scan)
    found = wall.propose(spec)
    if args.format == "table":
        _print_proposals(found, spec.count)
    else:
        _print_json(found)
    if args.put is not None:
        _append_entries(
            args.scan, [problem_entry(_chosen_row(found.proposals, args.put), wall.pool.by_id)]
        )
    return 0


def _adjust_grade(args: argparse.Namespace) -> int:
    from walltopo_climb.problems.edit_entries import tweak_entries

    wall = _read_wall(args.scan)
    found = wall.adjust_grade(args.route, "harder" if args.harder else "easier")
    if args.format == "table":
        _print_tweaks(found, args.harder)
    else:
        _print_json(found)
    if args.put is not None:
        route, tweak = wall.route(args.route), _chosen_row(found.tweaks, args.put)
        _append_entries(args.scan, tweak_entries(tweak, route, wall.pool.by_id))
    return 0


def _read_wall(path: Path) -> SetWall:
    from walltopo.scans.folder import ScanFolder
    from walltopo_climb.problems.wall import SetWall
    from walltopo_climb.wall_files import read_wall

    holds, routes, unit = read_wall(path)
    return SetWall.build(holds, routes, unit, ScanFolder.scale.load(ScanFolder(path)).floor_known)


def _chosen_row(rows: Sequence[Any], number: int) -> Any:
    from walltopo.core import SettingsError

    if number > len(rows):
        raise SettingsError(f"--put {number}: expected at most {len(rows)}; nothing was changed")
    return rows[number - 1]


def _append_entries(path: Path, entries: Sequence[Edit]) -> None:
    """Append entries to the log of edits, save it and rebuild the files."""
    from walltopo.cli.console import console
    from walltopo.core import InputError
    from walltopo.pipeline.edit_session import open_session
    from walltopo.scans.edits import EditLog
    from walltopo.scans.folder import ScanFolder

    session = open_session(ScanFolder(path))
    log, version = session.read()
    session.save(EditLog(edits=(*log.edits, *entries)), version)
    session.close()
    if problem := session.status().problem:
        raise InputError(f"{path}: saved in edits.json, but the files were not rebuilt: {problem}")
    console.print(f"written to {path}; undo it in the editor", soft_wrap=True)


def _print_json(found: object) -> None:
    import json

    import msgspec

    from walltopo.cli.console import console

    text = json.dumps(msgspec.to_builtins(found, str_keys=True), indent=1)
    console.out(text, highlight=False)


def _print_proposals(found: Proposals, requested: int) -> None:
    from walltopo.cli.console import console

    for k, one in enumerate(found.proposals, start=1):
        console.print(
            f"{k}: {one.grade.low} to {one.grade.high}, {one.moves} moves; holds "
            f"{_list_holds(one.hands)}; start {_list_holds(one.start)}, "
            f"top {_list_holds(one.top)}, feet {_list_holds(one.feet)}",
            soft_wrap=True,
        )
        console.print(f"   {climbers_summary(one.climbers)}", soft_wrap=True)
        for violation in one.violations:
            console.print(f"   not as requested: {_VIOLATIONS[violation]}", soft_wrap=True)
    if len(found.proposals) < requested:
        console.print(
            f"{len(found.proposals)} of {requested}: found no more that differ from each other",
            soft_wrap=True,
        )
    console.print(f"{found.tried} problems were tried")


def _print_tweaks(found: Tweaks, harder: bool) -> None:
    from walltopo.cli.console import console

    console.print(f"now {found.grade.low} to {found.grade.high}")
    for k, one in enumerate(found.tweaks, start=1):
        on = f" (also on route {one.on})" if one.on else ""
        more = "less" if one.eases > 0 else "more"
        console.print(
            f"{k}: {one.do} {one.hold}{on}: about {abs(one.by):.1f} grades "
            f"{'harder' if harder else 'easier'}, {one.grade.low} to {one.grade.high}; the hardest "
            f"move (to hold {one.crux}) takes {abs(one.eases):.0%} {more} effort",
            soft_wrap=True,
        )
        console.print(f"   {climbers_summary(one.climbers)}", soft_wrap=True)
    if not found.tweaks:
        console.print(f"none of {found.tried} changes has this effect")


def _list_holds(holds: Sequence[int]) -> str:
    return ", ".join(map(str, holds)) or "none"

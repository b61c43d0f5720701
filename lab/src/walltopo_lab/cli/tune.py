"""`walltopo tune`: search for the best settings on labelled walls and photos."""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from walltopo.cli.options import MAX_SEED, Number, add_needs, add_overwrite, output_target
from walltopo_lab.cli.tune_detector import add_detector
from walltopo_lab.extras import LEARN, PLOTS, modules_of

_EPILOG = """\
walls.toml lists labelled walls (paths relative to it):
  [[wall]]
  name = "gym1"            # the wall; all scans of one wall carry one name
  use = "train"            # train: tuned on; test: reported on
  truth = "gym1/truth"     # gt.npz, scene.json
  scan = "gym1/scan"       # or: mesh, cameras, masks; or nothing: the truth's own

examples:
  walltopo tune lift walls.toml -o tuned/ --trials 100
  walltopo tune lift walls.toml -o tuned/ --method literal --storage postgresql+pg8000://me@host/tuning
  walltopo tune routes walls.toml -o tuned/ --trials 60 --workers 2

Run again to go on; run on several machines with one database to share the work.
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `tune` group of commands."""
    group = commands.add_parser("tune", help="choose settings on labelled walls and photos")
    kinds = group.add_subparsers(dest="what", metavar="WHAT", required=True)
    for what, help in (
        ("lift", "the lift's settings, by instance AP"),
        ("routes", "the route settings, by adjusted Rand index"),
    ):
        parser = kinds.add_parser(
            what,
            help=help,
            description="Gaussian-process Bayesian optimisation (Optuna's GPSampler) of "
            + help
            + ". Writes walltopo.toml, report.md and slices.png.",
            epilog=_EPILOG,
            formatter_class=argparse.RawDescriptionHelpFormatter,
        )
        parser.add_argument("walls", type=Path, metavar="WALLS.toml", help="labelled walls")
        parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
        add_overwrite(parser)
        parser.add_argument(
            "--trials",
            type=Number(int, low=1),
            default=100,
            help="in all, resumed ones too (100)",
        )
        parser.add_argument("--storage", default="", help="database URL (default: DIR/study.db)")
        parser.add_argument(
            "--study", default="", help="name in the database (default: what it is)"
        )
        parser.add_argument(
            "--workers",
            type=Number(int, low=1, high=256),
            default=1,
            help="processes on this machine (1)",
        )
        parser.add_argument("--seed", type=Number(int, low=0, high=MAX_SEED), default=0)
        if what == "lift":
            parser.add_argument("--method", choices=("robust", "literal"), default="robust")
            parser.add_argument("--figure", choices=("ap", "ap50", "ap25", "coco_ap"), default="ap")
        parser.set_defaults(run=_run)
        add_needs(parser, _needs)
    add_detector(kinds)


def _make_task(what: str, walls: list[Any], method: str, figure: str) -> Any:
    if what == "lift":
        from walltopo_lab.tune.lift_task import LiftTask, load_lift_wall

        return LiftTask([load_lift_wall(wall) for wall in walls], method, figure)
    from walltopo_lab.tune.routes_task import RoutesTask, load_routes_wall

    return RoutesTask([load_routes_wall(wall) for wall in walls])


def _start_worker(args: argparse.Namespace, storage: str, name: str, seed: int) -> None:
    """Run an additional worker process on the same study."""
    from walltopo_lab.tune.study import open_study, run_trials
    from walltopo_lab.tune.walls import read_walls, wall_hashes

    train = [wall for wall in read_walls(args.walls) if wall.use == "train"]
    method, figure = getattr(args, "method", ""), getattr(args, "figure", "")
    task = _make_task(args.what, train, method, figure)
    run_trials(open_study(task, storage, name, seed, wall_hashes(train)), task, args.trials)


def _needs(args: argparse.Namespace) -> dict[str, str]:
    return {**modules_of("tune"), **PLOTS, **(LEARN if args.what == "routes" else {})}


def _run(args: argparse.Namespace) -> int:
    import multiprocessing

    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.tune.report import merge_settings, write_report, write_slices
    from walltopo_lab.tune.study import open_study, run_trials, study_results
    from walltopo_lab.tune.walls import read_walls, wall_hashes

    walls = read_walls(args.walls)
    train = [wall for wall in walls if wall.use == "train"]
    held_out = [wall for wall in walls if wall.use == "test"]
    # One folder for all `tune` commands: each search merges its settings into one walltopo.toml.
    claimed_folder(output_target(args, args.output, "tune", inputs=[args.walls]))
    storage = args.storage or f"sqlite:///{args.output / 'study.db'}"
    method, figure = getattr(args, "method", ""), getattr(args, "figure", "")
    name = args.study or "-".join(part for part in (args.what, method, figure) if part)
    task = _make_task(args.what, train, method, figure)
    study = open_study(task, storage, name, args.seed, wall_hashes(train))
    context = multiprocessing.get_context("spawn")
    others = [
        context.Process(target=_start_worker, args=(args, storage, name, args.seed + k))
        for k in range(1, args.workers)
    ]
    for process in others:
        process.start()
    with TerminalListener(console) as listener:
        run_trials(study, task, args.trials, listener)
    for process in others:
        process.join()
    found = study_results(study, task)
    test = None
    if held_out:
        judge = _make_task(args.what, held_out, method, figure)
        before = judge.evaluate(found.default.values)
        after = judge.evaluate(found.best.values)
        test = {wall: (before[wall], after[wall]) for wall in before}
    merge_settings(
        args.output / "walltopo.toml",
        task.section,
        {**task.fixed, **{k: round(v, 6) for k, v in found.best.values.items()}},
    )
    write_slices(args.output / "slices.png", task, found)
    write_report(args.output / "report.md", task, found, test)
    console.print(
        f"{task.figure} on train walls: {found.default.figure:.3f} -> {found.best.figure:.3f}"
    )
    if test is None:
        console.print("no test walls: this says nothing about other walls", style="yellow")
    for wall, (a, b) in (test or {}).items():
        console.print(f"test {wall}: {a:.3f} -> {b:.3f}")
    console.print(f"wrote {args.output}/walltopo.toml, report.md, slices.png")
    return 0

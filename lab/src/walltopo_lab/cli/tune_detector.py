"""`walltopo tune detector`: tune a detector's training hyperparameters by successive halving."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import MAX_SEED, Number, add_needs, add_overwrite, output_target
from walltopo_lab.extras import PLOTS, modules_of

_EPILOG = """\
examples:
  walltopo tune detector hold-boxes/train -o tuned/ --trials 30 --minutes 20
  walltopo tune detector hold-boxes/train -o tuned/ --family yolo11-seg --augment published
then
  walltopo train hold-boxes/train -o run --hyp tuned/tuned.toml

Run again to go on; a trial that was interrupted is not resumed but counts for nothing.
"""


def add_detector(kinds: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `detector` command to `walltopo tune`."""
    parser = kinds.add_parser(
        "detector",
        help="a detector's training, by AP50 on held-out photos",
        description="Train many times, stop what falls behind (Optuna's SuccessiveHalvingPruner), "
        "over learning rate, momentum, batch, size and the network's size. Writes tuned.toml, "
        "report.md and search.png.",
        epilog=_EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "datasets", type=Path, nargs="+", help="labelled sets, as for walltopo train"
    )
    parser.add_argument("-o", "--output", type=Path, required=True, metavar="DIR")
    add_overwrite(parser)
    parser.add_argument(
        "--family",
        choices=("votes", "yolo11-seg", "yolo11", "rtdetr"),
        default="votes",
        help="votes (default), or Ultralytics' (AGPL-3.0, extra [ultralytics])",
    )
    parser.add_argument(
        "--trials", type=Number(int, low=1), default=30, help="in all, resumed ones too (30)"
    )
    parser.add_argument(
        "--minutes",
        type=Number(float, low=0.01, high=1e6),
        default=30.0,
        help="of a trial that is never stopped (30)",
    )
    parser.add_argument(
        "--augment", default="default", metavar="default|none|published|FILE", help="of all trials"
    )
    parser.add_argument(
        "--pretrained",
        type=Path,
        metavar="DIR",
        help="folder of Ultralytics' weights, such as yolo11s-seg.pt, to start from",
    )
    parser.add_argument(
        "--held-out",
        type=Number(float, low=0.001, high=0.9),
        default=0.08,
        help="share kept to judge (0.08)",
    )
    parser.add_argument(
        "--threads", type=Number(int, low=1, high=256), default=1, help="CPU threads (1)"
    )
    parser.add_argument("--device", choices=("auto", "cpu", "cuda"), default="auto")
    parser.add_argument("--storage", default="", help="database URL (default: DIR/study.db)")
    parser.add_argument("--study", default="", help="name in the database (default: the family)")
    parser.add_argument("--seed", type=Number(int, low=0, high=MAX_SEED), default=0)
    parser.add_argument("-v", "--verbose", action="store_true", help="a line per trial and minute")
    parser.set_defaults(run=_run)
    add_needs(parser, _needs)


def _needs(args: argparse.Namespace) -> dict[str, str]:
    extras = ["tune", "train"] if args.family == "votes" else ["tune", "train", "ultralytics"]
    return {**modules_of(*extras), **PLOTS}


def _run(args: argparse.Namespace) -> int:
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core import InputError
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.train.params import read_augment
    from walltopo_lab.tune.detector import DetectorSearch, open_search, run_search, trials_of
    from walltopo_lab.tune.detector_report import best_trial, write_search

    if args.family == "votes" and args.pretrained:
        raise InputError("--pretrained is for Ultralytics' families")
    search = DetectorSearch(
        args.family,
        tuple(args.datasets),
        args.output,
        args.minutes,
        read_augment(args.augment),
        args.held_out,
        args.threads,
        args.device,
        args.pretrained,
    )
    claimed_folder(output_target(args, args.output, "tune", inputs=args.datasets))
    storage = args.storage or f"sqlite:///{args.output / 'study.db'}"
    study = open_search(search, storage, args.study or args.family, args.seed)
    with TerminalListener(console, verbose=args.verbose) as progress:
        run_search(study, search, args.trials, progress)
    trials = trials_of(study)
    write_search(args.output, search, trials)
    best = best_trial(trials)
    console.print(f"trial {best.number}: AP50 {best.best:.3f} with {best.values}")
    console.print(f"wrote {args.output}/tuned.toml, report.md, search.png")
    return 0

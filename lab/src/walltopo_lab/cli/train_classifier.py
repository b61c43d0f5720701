"""`walltopo train classifier`: train a classifier of hold cutouts."""

from __future__ import annotations

import argparse
from pathlib import Path

from walltopo.cli.options import (
    Parser,
    add_needs,
    add_options,
    add_overwrite,
    options_given,
    output_target,
)
from walltopo_lab.classifier.params import ClassifierSettings
from walltopo_lab.extras import modules_of

EXAMPLES = """\
examples:
  walltopo train classifier gym1 gym2 -o types.onnx               # scans, holds corrected by hand
  walltopo train classifier gym1 -o holds.onnx --label colour+type
  walltopo train classifier cutouts/ -o sets.onnx                 # cutouts/<class>/*.webp
  walltopo train classifier gym1 -o yolo.onnx --family yolo       # needs the ultralytics extra
then
  walltopo scan photos/ gym3 --set classify.model=types.onnx
"""


def classifier_parser(prog: str) -> argparse.ArgumentParser:
    """Return the parser of `walltopo train classifier`."""
    parser = Parser(
        prog=prog,
        description="Train a classifier of hold cutouts on labelled ones, and export it as ONNX "
        "with its class names. Sources: classified scan folders (their corrections count), gyms "
        "of `walltopo synth`, folders with one folder of pictures per class.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("sources", type=Path, nargs="+", help="labelled cutouts")
    parser.add_argument("-o", "--out", type=Path, required=True, help="ONNX file to write")
    add_overwrite(parser)
    parser.add_argument(
        "--label",
        choices=("type", "colour", "colour+type"),
        default="type",
        help="what a class is made of, in scans and generated gyms (default: type)",
    )
    parser.add_argument(
        "--family",
        choices=("small", "yolo"),
        default="small",
        help="small: walltopo's own network, 0.6 million weights; yolo: YOLO11-cls "
        "(default: small)",
    )
    parser.add_argument(
        "--base", default="", help="with --family yolo: weights or layout to start from"
    )
    parser.add_argument(
        "--classes",
        type=Path,
        metavar="TOML",
        help="what classes mean (type, colour, role), kept in the file; see docs/colours.md",
    )
    add_options(parser, ClassifierSettings)
    parser.set_defaults(run=run)
    add_needs(parser, _needs)
    return parser


def _needs(args: argparse.Namespace) -> dict[str, str]:
    return modules_of("train", "ultralytics") if args.family == "yolo" else modules_of("train")


def run(args: argparse.Namespace) -> int:
    """Train, export, and print the accuracy."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core import SettingsError
    from walltopo.core.outputs import written_file
    from walltopo_lab.classifier.cutout_classifier import read_classes
    from walltopo_lab.classifier.samples import read_cutouts

    if args.base and args.family != "yolo":
        raise SettingsError("--base is for --family yolo")
    settings = options_given(args, ClassifierSettings)
    with (
        written_file(
            output_target(args, args.out, "train classifier", inputs=args.sources)
        ) as made,
        TerminalListener(console) as progress,
    ):
        progress.step("reading cutouts")
        cutouts = read_cutouts(args.sources, args.label, settings.side)
        if args.classes is not None:
            cutouts = cutouts.meaning(read_classes(args.classes))
        counts = ", ".join(f"{name} {count}" for name, count in cutouts.counts().items())
        progress.note(f"{len(cutouts.label)} cutouts; holds per class: {counts}")
        if args.family == "yolo":
            from walltopo_lab.classifier.yolo import BASE, train_yolo

            top = train_yolo(cutouts, settings, made, args.base or BASE, progress)
            summary = f"{top:.3f} of the held-out cutouts right"
        else:
            from walltopo_lab.classifier.training import train, write_onnx

            trained = train(cutouts, settings, progress)
            write_onnx(trained, cutouts, made)
            summary = (
                f"{trained.accuracy:.3f} of {trained.holds[1]} held-out holds right, "
                f"{trained.per_cutout:.3f} of their cutouts (epoch {trained.epoch}, which they "
                "chose)"
            )
    console.print(f"{args.out}: {summary}", soft_wrap=True)
    return 0

"""`walltopo train`: train a detector on labelled photos."""

from __future__ import annotations

import argparse
import dataclasses
import shlex
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from walltopo.cli.options import add_needs, add_option, add_overwrite, output_target
from walltopo.core import InputError, SettingsError, settings_of
from walltopo_lab.cli.train_classifier import classifier_parser
from walltopo_lab.cli.train_gym import gym_parser
from walltopo_lab.cli.train_pack import pack_parser
from walltopo_lab.cli.train_shipped import (
    hold_types_parser,
    paint_parser,
    two_colours_parser,
)
from walltopo_lab.extras import PLOTS, modules_of
from walltopo_lab.train.params import (
    AugmentSettings,
    TrainSettings,
    YoloSettings,
    is_yolo,
    read_augment,
    read_values,
)

EXAMPLES = """\
examples:
  walltopo train hold-boxes/train -o run
  walltopo train hold-boxes/train synth/coco.json -o run --minutes 70 --threads 2
  walltopo train our-gym.json -o ours --pretrained onnx --encoder-rate 0 --rate 1e-4 --batch 4
  walltopo train hold-boxes/train -o yolo --model yolo11s-seg --augment published --device cuda
  walltopo train --pack sets.pack -o run --device cuda --minutes 20
The same command goes on where the last one stopped. The result is run/holds.onnx, for
`walltopo detect --model run/holds.onnx`; run/holds.md is its model card.

`walltopo train pack` writes prepared photos as one file, to train on another machine with --pack.
`walltopo train gym` trains the shipped network further on corrected scans of one gym.
Other things are trained by `walltopo train classifier` (what a hold is, from its cutouts),
`walltopo train hold-types` (the shipped namer of types) and `walltopo train paint` (the shipped
rule for routes.link = paint); each has its own --help.
"""


class _ByFirstWord(argparse.ArgumentParser):
    """A parser that delegates `train classifier ...` and similar commands to their own parsers.

    All other words go to the parser of `train DATASET...`.
    """

    def __init__(
        self, detector: argparse.ArgumentParser, others: Mapping[str, argparse.ArgumentParser]
    ) -> None:
        super().__init__(add_help=False)
        self._detector, self._others = detector, others
        self.parser_without_word, self.parsers_by_word = detector, tuple(others.values())
        # Shell completion inspects a parser's options: show it those of the detector.
        self._actions = detector._actions
        self._option_string_actions = detector._option_string_actions

    def parse_known_args(  # type: ignore[override]
        self, args: Sequence[str] | None = None, namespace: Any = None
    ) -> tuple[Any, list[str]]:
        words = list(args or [])
        if words and words[0] in self._others:
            return self._others[words[0]].parse_known_args(words[1:], namespace)
        return self._detector.parse_known_args(words, namespace)


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the `train` command."""
    parser = commands.add_parser(
        "train",
        help="train a detector on labelled photos",
        description="Train a network on YOLO box sets (made into pseudo-masks) and on COCO sets "
        "with masks; export it as ONNX with a model card.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "datasets", type=Path, nargs="*", help="YOLO folders (images/, labels/), COCO .json files"
    )
    parser.add_argument(
        "--pack", type=Path, metavar="FILE", help="train from a file of `walltopo train pack` alone"
    )
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder of the run")
    add_overwrite(parser)
    parser.add_argument(
        "--attribution", action="append", default=[], help="credit of a data set, for the card"
    )
    parser.add_argument(
        "--pretrained",
        metavar="FILE|onnx",
        help="start from this network instead of a new one: for votes an exported one (onnx: "
        "the shipped one) and a lower --rate, such as 1e-4; for Ultralytics' a .pt file",
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="a line per minute")
    parser.add_argument(
        "--model",
        default="votes",
        help="votes (default), or one of Ultralytics' networks (AGPL-3.0, extra [ultralytics]): "
        "yolo11s-seg, yolo11s, rtdetr-l and their sizes",
    )
    _add_training(parser)
    parser.set_defaults(run=run)
    add_needs(parser, _needs)
    others = {
        word: build(f"{parser.prog} {word}")
        for word, build in (
            ("gym", gym_parser),
            ("classifier", classifier_parser),
            ("hold-types", hold_types_parser),
            ("paint", paint_parser),
            ("two-colours", two_colours_parser),
            ("pack", pack_parser),
        )
    }
    commands.choices["train"] = _ByFirstWord(parser, others)


def _add_training(parser: argparse.ArgumentParser) -> None:
    """Add the settings of training and augmentation."""
    group = parser.add_argument_group("training")
    group.add_argument(
        "--hyp",
        type=Path,
        metavar="FILE",
        help="settings from a TOML file, such as tuned.toml of `walltopo tune detector`; the "
        "options below go before it",
    )
    _add_settings(group, TrainSettings, YoloSettings)
    group = parser.add_argument_group("augmentation")
    group.add_argument(
        "--augment",
        default="default",
        metavar="default|none|published|FILE",
        help="how photos are varied; a TOML file names what differs from the default, and the "
        "options below go before both",
    )
    _add_settings(group, AugmentSettings)


def _needs(args: argparse.Namespace) -> dict[str, str]:
    extras = ["train", "ultralytics"] if is_yolo(args.model) else ["train"]
    needs = {**modules_of(*extras), **PLOTS}
    defaults = (args.network, args.start, args.pretrained, args.hyp) == (None,) * 4
    if args.model == "votes" and defaults and not (args.out / "checkpoint.pt").is_file():
        needs |= modules_of("imagenet")
    return needs


def _add_settings(group: argparse._ArgumentGroup, *kinds: type[Any]) -> None:
    """Add an option per setting of these kinds, with default None."""
    known = [settings_of(kind) for kind in kinds]
    for field in {name: f for fields in reversed(known) for name, f in fields.items()}.values():
        summary = ", ".join(str(own[field.name].default) for own in known if field.name in own)
        if len(kinds) > 1 and field.name not in known[0]:
            summary = f"Ultralytics' networks only; {summary}"
        elif len(kinds) > 1 and field.name not in known[1]:
            summary = f"votes only; {summary}"
        add_option(group, field, summary)


def _given(args: argparse.Namespace, *kinds: type[Any]) -> dict[str, Any]:
    names = {name for kind in kinds for name in settings_of(kind)}
    return {name: getattr(args, name) for name in names if getattr(args, name) is not None}


def _model_settings(args: argparse.Namespace, kind: type[Any]) -> Any:
    """Return the settings of the chosen model; reject an option of another model."""
    known = settings_of(kind).keys()
    given = _given(args, TrainSettings, YoloSettings)
    for name in sorted(set(given) - known):
        raise SettingsError(
            f"--{name.replace('_', '-')} is not a setting of --model {args.model}",
            f"Its settings: {', '.join(sorted(known))}",
        )
    return kind(**{**(read_values(args.hyp, kind) if args.hyp else {}), **given})


def _augmentation(args: argparse.Namespace) -> AugmentSettings:
    return dataclasses.replace(read_augment(args.augment), **_given(args, AugmentSettings))


def run(args: argparse.Namespace) -> int:
    """Train, export, and print the metrics."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener

    votes = args.model == "votes"
    if not votes and not is_yolo(args.model):
        raise InputError(
            f"--model {args.model}: no network that can be trained",
            "Give votes, or one of Ultralytics' such as yolo11s-seg, yolo11s, rtdetr-l.",
        )
    if bool(args.datasets) == (args.pack is not None):
        raise InputError("expected labelled sets or --pack FILE, and not both")
    if args.pack is not None and not votes:
        raise InputError(f"--pack is of no use with --model {args.model}")
    settings = _model_settings(args, TrainSettings if votes else YoloSettings)
    augment = _augmentation(args)
    from walltopo.core.outputs import claimed_folder
    from walltopo_lab.detectors.fetch import cache_folder
    from walltopo_lab.train.detector import Job, train_detector
    from walltopo_lab.train.yolo import train_yolo

    words = [Path(w).name if Path(w).is_absolute() else w for w in sys.argv[1:]]
    claimed_folder(output_target(args, args.out, "train", inputs=[*args.datasets, args.pack]))
    job = Job(
        tuple(args.datasets),
        args.out,
        tuple(args.attribution),
        "walltopo " + shlex.join(words),
        _pretrained(args.pretrained, votes),
        cache_folder() / "train" / "prepared",
        args.pack,
    )
    with TerminalListener(console, verbose=args.verbose) as progress:
        if votes:
            figures = train_detector(job, settings, augment, progress)
        else:
            figures = train_yolo(job, args.model, settings, augment, progress)
    summary = ", ".join(f"{name} {value:.3f}" for name, value in figures.items())
    console.print(f"{args.out / 'holds.onnx'}: {summary}", soft_wrap=True)
    return 0


def _pretrained(text: str | None, votes: bool) -> Path | None:
    from walltopo.segment.detect.detector import shipped_model

    if text == "onnx":
        if not votes:
            raise InputError(
                "--pretrained onnx: the shipped network is a vote network",
                "Give Ultralytics' networks weights of their own kind (.pt).",
            )
        return shipped_model()
    return Path(text) if text else None

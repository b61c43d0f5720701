"""`walltopo train`: a detector from labelled photos."""

from __future__ import annotations

import argparse
import dataclasses
import shlex
import sys
from pathlib import Path
from typing import Any

from walltopo.cli.train_classifier import add_classifier_word
from walltopo.train.params import AugmentSettings, TrainSettings, read_augment

__all__ = ["register"]

EXAMPLES = """\
examples:
  walltopo train hold-boxes/train -o run
  walltopo train hold-boxes/train synth/coco.json -o run --minutes 70 --threads 2
  walltopo train our-gym.json -o ours --pretrained onnx --rate 3e-4 --minutes 10
The same command goes on where the last one stopped. The result is run/holds.onnx, for
`walltopo detect --model run/holds.onnx`; run/holds.md is its model card.
"""


def register(commands: argparse._SubParsersAction[argparse.ArgumentParser]) -> None:
    """Add the command."""
    parser = commands.add_parser(
        "train",
        help="train a detector on labelled photos",
        description="Train the vote network from fresh weights, on YOLO box sets (made into "
        "pseudo-masks) and on COCO sets with masks; export it as ONNX with a model card.",
        epilog=EXAMPLES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument(
        "datasets", type=Path, nargs="+", help="YOLO folders (images/, labels/), COCO .json files"
    )
    parser.add_argument("-o", "--out", type=Path, required=True, help="folder of the run")
    parser.add_argument(
        "--attribution", action="append", default=[], help="credit of a data set, for the card"
    )
    parser.add_argument(
        "--pretrained",
        metavar="FILE|onnx",
        help="start from this exported network (onnx: the shipped one) instead of fresh weights; "
        "give a lower --rate, such as 3e-4",
    )
    parser.add_argument("-v", "--verbose", action="store_true", help="a line per minute")
    _add_settings(parser.add_argument_group("training"), TrainSettings)
    group = parser.add_argument_group("augmentation")
    group.add_argument(
        "--augment",
        default="default",
        metavar="default|none|published|FILE",
        help="how photos are varied; a TOML file names what differs from the default, and the "
        "options below go before both",
    )
    _add_settings(group, AugmentSettings, given_only=True)
    parser.set_defaults(run=run)
    add_classifier_word(commands, parser)


def _add_settings(
    group: argparse._ArgumentGroup, kind: type[Any], given_only: bool = False
) -> None:
    for field in dataclasses.fields(kind):
        unit = f" [{field.metadata['unit']}]" if field.metadata["unit"] else ""
        text = f"{field.metadata['help']}{unit} (default: {field.default})"
        group.add_argument(
            "--" + field.name.replace("_", "-"),
            type=type(field.default),
            default=None if given_only else field.default,
            choices=field.metadata["choices"] or None,
            help=text.replace("%", "%%"),
        )


def _settings(args: argparse.Namespace, kind: type[Any]) -> Any:
    return kind(**{field.name: getattr(args, field.name) for field in dataclasses.fields(kind)})


def _augmentation(args: argparse.Namespace) -> AugmentSettings:
    given = {f.name: getattr(args, f.name) for f in dataclasses.fields(AugmentSettings)}
    return dataclasses.replace(
        read_augment(args.augment), **{k: v for k, v in given.items() if v is not None}
    )


def _path(text: str | None) -> Path | None:
    return Path(text) if text else None


def run(args: argparse.Namespace) -> int:
    """Train, export, say how good it is."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener
    from walltopo.core import EnvironmentLacksError

    settings, augment = _settings(args, TrainSettings), _augmentation(args)
    try:
        import torch  # noqa: F401
    except ImportError as error:
        raise EnvironmentLacksError(
            f"training needs PyTorch, which is not here ({error})",
            "Install the extra: pip install 'walltopo[train]'",
        ) from error
    from walltopo.detect.detector import shipped_model
    from walltopo.train.detector import Job, train_detector

    words = [Path(w).name if Path(w).is_absolute() else w for w in sys.argv[1:]]
    job = Job(
        tuple(args.datasets),
        args.out,
        tuple(args.attribution),
        "walltopo " + shlex.join(words),
        shipped_model() if args.pretrained == "onnx" else _path(args.pretrained),
    )
    with TerminalListener(console, verbose=args.verbose) as progress:
        figures = train_detector(job, settings, augment, progress)
    told = ", ".join(f"{name} {value:.3f}" for name, value in figures.items())
    console.print(f"{args.out / 'holds.onnx'}: {told}", soft_wrap=True)
    return 0

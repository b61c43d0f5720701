"""Training of the shipped detector without end, and its quantization: `make train` and others.

The state is outside the checkout, so that any later checkout can resume it: prepared
photos, rendered gyms, checkpoint and page. A run may be killed at any moment; the next one resumes
from the last checkpoint, at most two minutes back.
"""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from walltopo.core import InputError, Progress
from walltopo.core.files import read_json, write_json
from walltopo.core.locks import take_lock
from walltopo.images.networks import open_network
from walltopo.segment.detect.detector import shipped_model, shipped_quantized
from walltopo.segment.settings import DetectSettings
from walltopo_lab.train.audit import audit
from walltopo_lab.train.batches import CropSource
from walltopo_lab.train.choose import check_on
from walltopo_lab.train.loop import InitialWeights, Run, cool_down, load_run, train
from walltopo_lab.train.net import VoteNet
from walltopo_lab.train.outlines import redraw
from walltopo_lab.train.pack import write_pack
from walltopo_lab.train.page import write_page
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.quantize import calibration_inputs, quantize
from walltopo_lab.train.sets import LabelledSet, drop_photos
from walltopo_lab.train.shipped_export import (
    Comparison,
    compare,
    compare_files,
    comparison_table,
    replace_shipped,
)
from walltopo_lab.train.shipped_sets import (
    QUICK_CHECK,
    Part,
    open_shipped_sets,
    validation_parts,
)
from walltopo_lab.train.warm import load_exported

Show = Callable[[str], None]

# An endless run; the averaged weights span at most 2,000 steps.
AUGMENT = AugmentSettings(paste=0.35, mosaic=0.08, scale_low=0.42, scale_high=2.5, degrade=0.3)
SETTINGS = TrainSettings(minutes=0.0, rate=5e-4, ema=0.9995, check_every=30.0)

CALIBRATION_PHOTOS = 64
MAX_QUANTIZATION_LOSS = 0.003  # AP50 of boxes, mean of the classes, on the validation photos


@dataclass(frozen=True)
class TrainingFolder:
    """The folder of a run's persistent state."""

    folder: Path

    @property
    def prepared(self) -> Path:
        return self.folder / "prepared"

    @property
    def rendered(self) -> Path:
        return self.folder / "rendered"

    @property
    def checkpoint(self) -> Path:
        return self.folder / "checkpoint.pt"

    @property
    def exported(self) -> Path:
        return self.folder / "holds.onnx"

    @property
    def quantized(self) -> Path:
        return self.folder / "holds-int8.onnx"

    @property
    def page(self) -> Path:
        return self.folder / "train.html"

    @contextmanager
    def only_run(self) -> Iterator[None]:
        """Hold the folder's lock and write this process's id to `pid`.

        Raises
        ------
        InputError : another run has the lock.
        """
        self.folder.mkdir(parents=True, exist_ok=True)
        with (self.folder / "lock").open("w") as stream:
            if not take_lock(stream):
                raise InputError(
                    f"{self.folder}: a run is using this folder",
                    f"Its process is in {self.folder / 'pid'}.",
                )
            (self.folder / "pid").write_text(f"{os.getpid()}\n")
            yield


def quick_check(parts: Sequence[Part]) -> Part:
    """Return a fixed small sample of each part's photos, for checks during training."""
    photos: list[tuple[Path, str]] = []
    exact: list[bool] = []
    for part in parts:
        count = min(QUICK_CHECK.get(part.name, 0), len(part.photos))
        for k in np.linspace(0, len(part.photos) - 1, count).round().astype(int):
            photos.append(part.photos[k])
            exact.append(part.exact[k])
    return Part("quick check", tuple(photos), tuple(exact))


def _without_wrong_labels(
    sets: Sequence[LabelledSet], state: TrainingFolder, progress: Progress
) -> list[LabelledSet]:
    """Drop photos whose labels do not fit the image, according to the shipped network."""
    file = state.prepared / "audit.json"
    known: dict[str, list[str]] = read_json(file) if file.is_file() else {}
    for item in sets:
        if item.name not in known and not item.exact and item.train:
            verdicts = audit(load_exported(shipped_model()), item.folder, item.train, progress)
            known[item.name] = [verdict.name for verdict in verdicts if verdict.wrong]
            write_json(file, known)
    return [drop_photos(item, known.get(item.name, [])) for item in sets]


def _open_sets(
    data: Path, state: TrainingFolder, progress: Progress
) -> tuple[list[LabelledSet], list[float], list[Part]]:
    """Return the training sets with their shares of the crops, and the validation photos."""
    sets, shares = open_shipped_sets(data, state.rendered, state.prepared, progress)
    sets = _without_wrong_labels(sets, state, progress)
    used = [(s, share) for s, share in zip(sets, shares, strict=True) if share > 0]
    return [s for s, _ in used], [share for _, share in used], validation_parts(sets)


def _folders(sets: Sequence[LabelledSet]) -> list[tuple[Path, Sequence[str]]]:
    return [(item.folder, item.train) for item in sets]


def _crop_source(sets: Sequence[LabelledSet], shares: Sequence[float]) -> CropSource:
    exact = _folders([item for item in sets if item.exact])
    return CropSource(_folders(sets), shares, SETTINGS, AUGMENT, exact)


def training_of(model: Path) -> tuple[int, float]:
    """Return the steps and processor seconds that a network file's metadata state, or zeros."""
    network = open_network(model)
    hours = network.number("core_hours", 0.0)
    return int(network.number("steps", 0.0)), hours * 3600


def run(data: Path, state: TrainingFolder, progress: Progress) -> None:
    """Train until interrupted.

    Raises
    ------
    InputError : a set is missing, or another run uses the folder.
    """
    with state.only_run():
        used, shares, parts = _open_sets(data, state, progress)
        chosen = quick_check(parts)

        def check(net: VoteNet) -> dict[str, float]:
            return check_on(net, chosen.photos, chosen.exact)

        def report(run: Run) -> None:
            write_json(state.folder / "history.json", run.history)
            write_page(state.page, run.history)

        steps, cpu_seconds = training_of(shipped_model())
        start = InitialWeights(None, shipped_model(), steps, cpu_seconds)
        source = _crop_source(used, shares)
        train(source, start, state.checkpoint, check, progress, report=report)


def export(
    data: Path, state: TrainingFolder, progress: Progress, cool_steps: int = 0
) -> Comparison:
    """Export the averaged weights to the state's `holds.onnx` and compare with the shipped file.

    A run may continue meanwhile: its last checkpoint is used.

    Parameters
    ----------
    cool_steps : steps in which a copy of the run lowers its rate to zero before the export.

    Raises
    ------
    InputError : there is no checkpoint, or a set is missing.
    """
    run = load_run(state.checkpoint, SETTINGS)
    used, shares, parts = _open_sets(data, state, progress)
    if cool_steps:
        cool_down(run, _crop_source(used, shares), cool_steps, progress)
    return compare(run, parts, shipped_model(), state.exported, progress)


def quantize_shipped(data: Path, state: TrainingFolder, progress: Progress) -> Comparison:
    """Quantize the shipped network to the state's `holds-int8.onnx`; compare the two.

    Raises
    ------
    InputError : a set is missing.
    """
    sets, _ = open_shipped_sets(data, state.rendered, state.prepared, progress)
    photos = [(item.folder, name) for item in sets for name in item.train]
    chosen = [photos[int(k)] for k in np.linspace(0, len(photos) - 1, CALIBRATION_PHOTOS)]
    progress.step("quantization")
    quantize(shipped_model(), calibration_inputs(chosen, DetectSettings()), state.quantized)
    return compare_files(state.quantized, validation_parts(sets), shipped_model(), progress)


def pack(data: Path, state: TrainingFolder, out: Path, progress: Progress) -> int:
    """Write the sets of the shipped detector as a pack; return its size in bytes.

    The shipped network draws the masks inside labelled boxes.

    Raises
    ------
    InputError : a set is missing, or the pack would be too large.
    """
    sets, shares = open_shipped_sets(data, state.rendered, state.prepared, progress)
    net = load_exported(shipped_model()).eval()
    return write_pack(out, sets, progress, shares=shares, redraw=partial(redraw, net))


def _show_comparison(made: Comparison, show: Show) -> None:
    """Print the table of a comparison and the calibrated settings."""
    show(comparison_table(made))
    show(", ".join(f"{name} {value:.3f}" for name, value in made.settings.items()))


def _export_network(
    args: argparse.Namespace, state: TrainingFolder, progress: Progress, show: Show
) -> None:
    """Export, print the comparison and, if requested, replace the shipped file."""
    made = export(args.data, state, progress, args.cool_down)
    _show_comparison(made, show)
    show("The exported network is better." if made.is_better else "The shipped network is better.")
    if args.replace and replace_shipped(made, state.exported, shipped_model()):
        show(f"It replaces {shipped_model().name}. Put the table into the model card.")
        show("Make its quantized copy anew, too: `make train-quantize EXPORT=--replace`.")


def _quantize_network(
    args: argparse.Namespace, state: TrainingFolder, progress: Progress, show: Show
) -> None:
    """Quantize the shipped network, print the comparison and, if requested, ship the result."""
    made = quantize_shipped(args.data, state, progress)
    _show_comparison(made, show)
    show(f"The mean of the classes changes by {made.gain:+.4f}.")
    if args.replace and replace_shipped(
        made, state.quantized, shipped_quantized(), MAX_QUANTIZATION_LOSS
    ):
        show(f"It replaces {shipped_quantized().name}. Put the table into the model card.")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command `python -m walltopo_lab.train.shipped` and return its exit code."""
    from walltopo.cli.console import console
    from walltopo.cli.listener import TerminalListener

    args = _parser().parse_args(arguments)
    state = TrainingFolder(args.state.expanduser())
    with TerminalListener(console, verbose=True) as progress:
        try:
            if args.what == "run":
                run(args.data, state, progress)
            elif args.what == "pack":
                size = pack(args.data, state, args.out, progress)
                console.print(f"{args.out}: {size / 1e6:.1f} MB", soft_wrap=True)
            else:
                act = _quantize_network if args.what == "quantize" else _export_network
                act(args, state, progress, lambda text: console.print(text, soft_wrap=True))
        except InputError as error:
            console.print(f"{error}\n{error.hint or ''}", style="red", soft_wrap=True)
            return 1
    return 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument(
        "what",
        choices=("run", "export", "quantize", "pack"),
        help="train; export and compare; quantize the shipped network and compare; or write the "
        "sets as one file for another machine",
    )
    parser.add_argument("--data", type=Path, required=True, help="folder of the labelled sets")
    parser.add_argument("--state", type=Path, required=True, help="folder of the run's state")
    parser.add_argument(
        "--replace",
        action="store_true",
        help="export, quantize: replace the shipped file if the comparison allows",
    )
    parser.add_argument(
        "--out", type=Path, default=Path("shipped.pack"), help="pack: file to write"
    )
    parser.add_argument(
        "--cool-down", type=int, default=0, metavar="STEPS", help="export: lower the rate first"
    )
    return parser


if __name__ == "__main__":
    sys.exit(main())

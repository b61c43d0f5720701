"""The table of three detector families in four variants, n runs averaged, as Markdown.

    python -m walltopo_lab.benchmarks.detector_table TRAIN --test SET [--runs 3] [--minutes 60] [-o FOLDER]

TRAIN and SET are labelled sets as for `walltopo train` and `walltopo evaluate`. Families:
yolo11-seg (its own masks), yolo11-sam and rtdetr-sam (boxes, masks by Segment Anything).
Variants: scratch (fresh weights, no augmentation), -pt (COCO weights), -aug (those and the
published augmentation), -hyp (those and the settings that `walltopo tune detector` found).

Needs the `[ultralytics]` extra; for -pt and further `--weights DIR` with Ultralytics' COCO
weights (`yolo11s-seg.pt`, `yolo11s.pt`, `rtdetr-l.pt`); for -hyp `--tuned DIR` with
`<network>.toml` (`yolo11s-seg.toml`, ...); for -sam SAM's weights (fetched once). What is lacking
is told before anything is trained; `--families` and `--variants` leave it out. Runs that were
finished are kept in FOLDER.
"""

from __future__ import annotations

import argparse
import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console

from walltopo.core import EnvironmentLacksError, Silent
from walltopo.core.files import read_json, write_json
from walltopo.detect.contract import DetectSettings
from walltopo_lab.benchmarks.detectors import LOW_SCORE, as_dataset, look
from walltopo_lab.datasets.model import Dataset
from walltopo_lab.datasets.read import read_dataset
from walltopo_lab.detectors.families import open_family
from walltopo_lab.detectors.fetch import SAM_WEIGHTS, cache_folder
from walltopo_lab.evaluate.detector import evaluate_detections
from walltopo_lab.train.detector import Job
from walltopo_lab.train.params import AUGMENTS, YoloSettings, read_values
from walltopo_lab.train.yolo import train_yolo

NETWORKS = {"yolo11-seg": "yolo11{}-seg", "yolo11-sam": "yolo11{}", "rtdetr-sam": "rtdetr-l"}
VARIANTS = ("scratch", "pt", "aug", "hyp")
FIGURES = ("boxes AP50", "boxes AP", "masks AP50", "masks AP")


@dataclass(frozen=True)
class Run:
    """One training of the table."""

    family: str
    variant: str
    seed: int
    network: str

    @property
    def title(self) -> str:
        return self.family if self.variant == "scratch" else f"{self.family}-{self.variant}"

    @property
    def folder(self) -> str:
        """Families that share a network share its training."""
        return f"{self.network}-{self.variant}-{self.seed}"


@dataclass(frozen=True)
class Sources:
    """Where weights and settings come from."""

    train: tuple[Path, ...]
    test: Path
    out: Path
    weights: Path | None
    tuned: Path | None
    sam: str
    minutes: float
    device: str

    def weights_of(self, run: Run) -> Path | None:
        if run.variant == "scratch":
            return None
        return (self.weights or Path("WEIGHTS")) / f"{run.network}.pt"

    def settings_of(self, run: Run) -> Path | None:
        if run.variant != "hyp":
            return None
        return (self.tuned or Path("TUNED")) / f"{run.network}.toml"


def plan(families: Sequence[str], variants: Sequence[str], runs: int, scale: str) -> list[Run]:
    """All trainings, in the table's order."""
    return [
        Run(family, variant, seed, NETWORKS[family].format(scale))
        for family, variant, seed in itertools.product(families, variants, range(runs))
    ]


def lacking(runs: Sequence[Run], sources: Sources) -> list[str]:
    """What must be there before the table can be made, and is not."""
    wanted = [path for run in runs for path in (sources.weights_of(run), sources.settings_of(run))]
    missing = sorted({str(path) for path in wanted if path is not None and not path.is_file()})
    sam = SAM_WEIGHTS[sources.sam]
    if (
        any(run.family.endswith("-sam") for run in runs)
        and not (cache_folder() / sam.file).is_file()
    ):
        missing.append(f"{cache_folder() / sam.file} (from {sam.address})")
    return missing


def settings_for(run: Run, sources: Sources) -> YoloSettings:
    """How a run is trained."""
    hyp = sources.settings_of(run)
    values = read_values(hyp, YoloSettings) if hyp else {}
    values |= {"minutes": sources.minutes, "seed": run.seed, "device": sources.device}
    return YoloSettings(**values)


def train_run(run: Run, sources: Sources) -> Path:
    """The best weights of one training; resumes."""
    augment = AUGMENTS["published" if run.variant in ("aug", "hyp") else "none"]
    job = Job(
        sources.train,
        sources.out / run.folder,
        pretrained=sources.weights_of(run),
        cache=sources.out / "cache",
    )
    best = job.out / "ultralytics" / "weights" / "best.pt"
    if not (job.out / "holds.onnx").is_file():
        train_yolo(job, run.network, settings_for(run, sources), augment, Silent())
    return best


def figures_of(run: Run, sources: Sources) -> dict[str, float]:
    """COCO's figures on the test set, classes as one; kept."""
    kept = sources.out / f"{run.title}-{run.seed}.json"
    if kept.is_file():
        return {str(k): float(v) for k, v in read_json(kept).items()}
    weights = train_run(run, sources)
    settings = DetectSettings(
        weights=str(weights),
        sam=sources.sam,  # type: ignore[arg-type]  # argparse checks its choices
        size=settings_for(run, sources).size,
        score=LOW_SCORE,
        device=sources.device,  # type: ignore[arg-type]
    )
    detector = open_family(run.family, settings)
    truth = read_dataset(sources.test)
    photos = tuple(p for p in truth.photos if p.annotations and p.path is not None)
    truth = Dataset(photos, truth.classes)
    seen = look(detector, [p.path for p in photos if p.path]).found
    result = evaluate_detections(as_dataset(truth, seen, detector.classes, masks=True), truth)
    figures = {"boxes AP50": result.boxes["all"].ap50, "boxes AP": result.boxes["all"].ap}
    if result.masks:
        figures |= {"masks AP50": result.masks["all"].ap50, "masks AP": result.masks["all"].ap}
    write_json(kept, figures)
    return figures


def markdown(rows: dict[str, list[dict[str, float]]]) -> str:
    """Mean and spread of each row's runs."""
    lines = [f"| | runs | {' | '.join(FIGURES)} |", f"|---|---|{'---|' * len(FIGURES)}"]
    for title, runs in rows.items():
        cells = []
        for name in FIGURES:
            values = [run[name] for run in runs if name in run]
            told = f"{np.mean(values):.3f}" if values else "-"
            cells.append(told + (f" ± {np.std(values, ddof=1):.3f}" if len(values) > 1 else ""))
        lines.append(f"| {title} | {len(runs)} | {' | '.join(cells)} |")
    return "\n".join(lines)


def main() -> None:
    """Command line."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("train", type=Path, nargs="+")
    parser.add_argument("--test", type=Path, required=True)
    parser.add_argument("-o", "--out", type=Path, default=Path("detector-table"))
    parser.add_argument("--runs", type=int, default=3)
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--scale", default="s", choices=("n", "s", "m", "l", "x"))
    parser.add_argument("--weights", type=Path)
    parser.add_argument("--tuned", type=Path)
    parser.add_argument("--sam", default="mobile-sam", choices=tuple(SAM_WEIGHTS))
    parser.add_argument("--device", default="auto", choices=("auto", "cpu", "cuda"))
    parser.add_argument("--families", nargs="+", default=list(NETWORKS), choices=NETWORKS)
    parser.add_argument("--variants", nargs="+", default=list(VARIANTS), choices=VARIANTS)
    args = parser.parse_args()
    sources = Sources(
        tuple(args.train), args.test, args.out, args.weights, args.tuned, args.sam, args.minutes,
        args.device,
    )  # fmt: skip
    runs = plan(args.families, args.variants, args.runs, args.scale)
    missing = lacking(runs, sources)
    if missing:
        raise SystemExit(
            str(
                EnvironmentLacksError(
                    "the table cannot be made, these files are lacking:\n  " + "\n  ".join(missing),
                    "Put them there (--weights, --tuned), or choose --families and --variants.",
                )
            )
        )
    rows: dict[str, list[dict[str, float]]] = {}
    for run in runs:
        rows.setdefault(run.title, []).append(figures_of(run, sources))
    Console(width=120).print(markdown(rows), markup=False)


if __name__ == "__main__":
    main()

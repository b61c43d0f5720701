"""The model card of an exported network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path

from walltopo.core.files import atomic_path
from walltopo_lab.train.params import AugmentSettings, TrainSettings


@dataclass(frozen=True)
class CardFacts:
    """Contents of a model card.

    Parameters
    ----------
    sets : per data set its name and its numbers of training, held-out and rejected photos.
    attribution : credit and licence of the data, one line per set.
    command : the command that reproduces the training.
    parameters : number of weights in the network.
    step, minutes : length of the run that produced these weights.
    figures : metrics on the held-out photos.
    pretrained : the initial network of the run; '' for random weights.
    """

    sets: Sequence[tuple[str, int, int, int]]
    attribution: Sequence[str]
    command: str
    parameters: int
    step: int
    minutes: float
    figures: Mapping[str, float]
    pretrained: str = ""


def _table(rows: Mapping[str, object]) -> list[str]:
    return ["| | |", "|---|---|", *(f"| {key} | {value} |" for key, value in rows.items())]


def _data_section(sets: Sequence[tuple[str, int, int, int]], credit: Sequence[str]) -> list[str]:
    return [
        "## Data",
        "",
        "| set | trained on | held out | dropped (labels do not fit) |",
        "|---|---|---|---|",
        *(f"| {name} | {n} | {held} | {dropped} |" for name, n, held, dropped in sets),
        "",
        *(f"- {line}" for line in credit),
        "",
        "Sets with boxes only were made into pseudo-masks (GrabCut in the box, undecided where "
        "colour cannot tell).",
        "",
    ]


def write_card(
    path: Path, facts: CardFacts, settings: TrainSettings, augment: AugmentSettings
) -> None:
    """Write the card as Markdown."""
    lines = [
        f"# {path.stem}",
        "",
        "Finds holds and volumes in photos of indoor climbing walls: boxes, masks, scores.",
        f"Vote network (`walltopo_lab.train.net`), {facts.parameters / 1e6:.2f} M weights, trained "
        f"from {facts.pretrained or f'{settings.start} weights'} for {facts.minutes:.0f} minutes "
        f"({facts.step} steps of {settings.batch} crops of {settings.crop} px).",
        "",
        *_data_section(facts.sets, facts.attribution),
        "## Figures on the held-out photos",
        "",
        "These photos chose the weights and the threshold: they flatter. The figures to quote "
        "come from `python -m benchmarks.detectors`, on photos that chose nothing.",
        "",
        *_table({key: f"{value:.3f}" for key, value in facts.figures.items()}),
        "",
        "## Command",
        "",
        f"    {facts.command}",
        "",
        "## Settings",
        "",
        *_table({**asdict(settings), **asdict(augment)}),
    ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")


def yolo_card(
    path: Path,
    name: str,
    credit: Sequence[str],
    command: str,
    sets: Sequence[tuple[str, int, int, int]],
    tables: Sequence[Mapping[str, object]],
    figures: Mapping[str, float],
) -> None:
    """Write the model card of an Ultralytics network.

    Parameters
    ----------
    sets : as in `CardFacts`.
    tables : training settings, then augmentation settings.
    """
    lines = [
        f"# {path.stem}",
        "",
        f"Finds holds and volumes in photos of indoor climbing walls: {name}, trained and exported "
        "by Ultralytics (AGPL-3.0: its licence reaches these weights and what is built on them).",
        "",
        *_data_section(sets, credit),
        "## Figures on the held-out photos",
        "",
        "These photos chose the thresholds: they flatter.",
        "",
        *_table({key: f"{value:.3f}" for key, value in figures.items()}),
        "",
        "## Command",
        "",
        f"    {command}",
        "",
        "## Settings",
        "",
        *_table({key: value for table in tables for key, value in table.items()}),
    ]
    with atomic_path(path) as temporary:
        temporary.write_text("\n".join(lines) + "\n", encoding="utf-8")

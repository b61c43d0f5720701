"""The implementation of `walltopo train`: data sets in, ONNX file, card and plot out."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from walltopo.core import Progress
from walltopo.core.files import read_json, write_json
from walltopo_lab.plots import make_panels, save_figure
from walltopo_lab.train.audit import audit
from walltopo_lab.train.batches import CropSource
from walltopo_lab.train.calibrate import calibrate
from walltopo_lab.train.card import CardFacts, write_card
from walltopo_lab.train.choose import check_on
from walltopo_lab.train.export import export_onnx
from walltopo_lab.train.loop import InitialWeights, Run, train
from walltopo_lab.train.net import NET_SIZES, VoteNet, build_net
from walltopo_lab.train.pack import open_pack
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.sets import LabelledSet, drop_photos, open_sets

OnCheck = Callable[[int, float], None]


@dataclass(frozen=True)
class Job:
    """Options of `walltopo train`.

    Parameters
    ----------
    datasets : YOLO folders (`images/`, `labels/`) and COCO files (photos beside them, in
        `photos/` or in `images/`).
    out : folder of the run: cache, checkpoint, audit, results.
    attribution : credit of the data, for the card.
    command : the command line of the run, for the card.
    pretrained : an exported network to start from, or None for a new one.
    cache : cache of labelled photos, None for a folder of the run; runs may share one.
    pack : a file of `walltopo train pack` in place of the data sets, or None.
    """

    datasets: tuple[Path, ...]
    out: Path
    attribution: tuple[str, ...] = ()
    command: str = "walltopo train"
    pretrained: Path | None = None
    cache: Path | None = None
    pack: Path | None = None

    @property
    def cached(self) -> Path:
        """Return the folder of the cache."""
        return self.cache or self.out / "cache"


def _held_out(sets: Sequence[LabelledSet], count: int) -> tuple[Path, list[str]]:
    """Return evenly sampled held-out photos of the first set that has any, for validation.

    Without held-out photos, training photos of the first set are used.
    """
    for item in sets:
        if item.held_out:
            pick = np.linspace(0, len(item.held_out) - 1, min(count, len(item.held_out)))
            return item.folder, [item.held_out[int(k)] for k in pick]
    item = sets[0]
    return item.folder, list(item.train[:count])


def _drop_wrong(
    job: Job, sets: Sequence[LabelledSet], net: VoteNet | None, progress: Progress
) -> list[LabelledSet]:
    """Drop photos whose labels do not fit; cache the verdicts in the run's folder."""
    verdicts_file = job.out / "audit.json"
    if net is not None and not verdicts_file.is_file():
        verdicts = {
            s.name: [dataclasses.asdict(v) for v in audit(net, s.folder, s.train, progress)]
            for s in sets
            if not s.exact
        }
        write_json(verdicts_file, verdicts)
    if not verdicts_file.is_file():
        return list(sets)
    wrong = {v["name"] for items in read_json(verdicts_file).values() for v in items if v["wrong"]}
    progress.note(f"{len(wrong)} photos left out: their labels do not fit the picture")
    return [drop_photos(s, wrong) for s in sets]


def _crop_shares(sets: Sequence[LabelledSet], synthetic: float) -> list[float]:
    """Return each set's share of the crops.

    Exact sets together get `synthetic`; sets of one kind divide their share by number of photos.
    """
    photos = [len(s.train) for s in sets]
    exact = sum(n for s, n in zip(sets, photos, strict=True) if s.exact)
    boxes = sum(photos) - exact
    if not exact or not boxes:
        return [n / sum(photos) for n in photos]
    return [
        synthetic * n / exact if s.exact else (1 - synthetic) * n / boxes
        for s, n in zip(sets, photos, strict=True)
    ]


def _open_sets(
    job: Job, settings: TrainSettings, progress: Progress
) -> tuple[list[LabelledSet], dict[str, float]]:
    """Return the sets of a job, and the shares of the crops that its pack states, by set."""
    if job.pack is None:
        return open_sets(job.datasets, job.cached, settings.held_out, progress), {}
    pack = open_pack(job.pack, job.cached, progress)
    names = [item.name for item in pack.sets]
    return list(pack.sets), dict(zip(names, pack.shares, strict=True)) if pack.shares else {}


def plot_history(history: Sequence[Mapping[str, float]], path: Path) -> None:
    """Plot the losses and held-out metrics over the minutes of a run; `history` as in `Run`."""
    figure, axes = make_panels(2, columns=1)
    titles = {"training loss": ("heat", "box", "mask"), "held-out AP50": ("ap50",)}
    for panel, (title, starts) in zip(axes, titles.items(), strict=True):
        for key in dict.fromkeys(key for row in history for key in row if key.startswith(starts)):
            rows = [row for row in history if key in row]
            panel.plot([row["minutes"] for row in rows], [row[key] for row in rows], label=key)
        panel.set(title=title, xlabel="minutes")
        panel.set_ylim(bottom=0)
    for panel in axes:
        if panel.lines:
            panel.legend()
    save_figure(figure, path)


def export_run(
    run: Run,
    job: Job,
    sets: Sequence[LabelledSet],
    settings: TrainSettings,
    augment: AugmentSettings,
    progress: Progress,
) -> dict[str, Any]:
    """Write `holds.onnx`, its card and the plot from the best weights of a run."""
    net = build_net(run.net.size)
    net.load_state_dict(run.best_state or run.average.state_dict())
    net.eval()
    folder, names = _held_out(sets, max(settings.check_photos, 48))
    photos = [(folder, name) for name in names]
    figures = check_on(net, photos)
    facts = {"version": f"step {run.step}", "size": net.size.as_dict()}
    model = job.out / "holds.onnx"
    difference = export_onnx(net, model, facts)
    # Calibrate with all passes, as in the product; the checks used one pass.
    used, _ = calibrate(model, photos, progress)
    used["ap50_as_used"] = used.pop("ap50")
    parameters = sum(p.numel() for p in net.parameters())
    card = CardFacts(
        [(s.name, len(s.train), len(s.held_out), len(s.dropped)) for s in sets],
        job.attribution,
        job.command,
        parameters,
        run.step,
        run.seconds / 60,
        {**figures, **used},
        job.pretrained.name if job.pretrained else "",
    )
    write_card(job.out / "holds.md", card, settings, augment)
    plot_history(run.history, job.out / "history.svg")
    write_json(job.out / "history.json", run.history)
    return {**figures, **used, "export_difference": difference}


def fit_detector(
    job: Job,
    settings: TrainSettings,
    augment: AugmentSettings,
    progress: Progress,
    on_check: OnCheck | None = None,
) -> tuple[Run, list[LabelledSet]]:
    """Train, or resume training, without the export.

    Parameters
    ----------
    on_check : called after each check with its number from 1 and AP50 on held-out photos; an
        exception ends the training.
    """
    sets, stated = _open_sets(job, settings, progress)
    folder, names = _held_out(sets, settings.check_photos)
    checks = 0

    def check(net: VoteNet) -> dict[str, float]:
        nonlocal checks
        figures = check_on(net, [(folder, name) for name in names])
        checks += 1
        if on_check is not None:
            on_check(checks, figures["ap50"])
        return figures

    def leg(parts: Sequence[LabelledSet], until: float) -> Run:
        used = [s for s in parts if s.train and stated.get(s.name, 1.0) > 0]
        shares = (
            [stated[s.name] for s in used] if stated else _crop_shares(used, settings.synthetic)
        )
        source = CropSource(
            [(s.folder, s.train) for s in used],
            [share / sum(shares) for share in shares],
            settings,
            augment,
            [(s.folder, s.train) for s in used if s.exact],
        )
        start = InitialWeights(NET_SIZES[settings.network], job.pretrained)
        return train(source, start, job.out / "checkpoint.pt", check, progress, until)

    if 0 < settings.audit < 1 and not (job.out / "audit.json").is_file():
        run = leg(sets, settings.audit)
        _drop_wrong(job, sets, run.average, progress)
    sets = _drop_wrong(job, sets, None, progress)
    return leg(sets, 1.0), sets


def train_detector(
    job: Job, settings: TrainSettings, augment: AugmentSettings, progress: Progress
) -> dict[str, Any]:
    """Train, or resume training, and export; return the held-out metrics.

    Raises
    ------
    InputError : a data set cannot be read, or the folder holds another run's checkpoint.
    """
    run, sets = fit_detector(job, settings, augment, progress)
    return export_run(run, job, sets, settings, augment, progress)

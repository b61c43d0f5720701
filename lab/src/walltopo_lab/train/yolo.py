"""Training of Ultralytics' networks on the same sets (extra `[ultralytics]`, AGPL-3.0)."""

from __future__ import annotations

import time
from dataclasses import asdict
from pathlib import Path
from typing import Any

from walltopo.core import InputError, Progress
from walltopo.core.files import read_json, write_json
from walltopo_lab.extras import need_ultralytics
from walltopo_lab.onnx_file import save_model, set_metadata
from walltopo_lab.train.calibrate import calibrate
from walltopo_lab.train.card import yolo_card
from walltopo_lab.train.detector import Job, OnCheck
from walltopo_lab.train.params import AugmentSettings, YoloSettings
from walltopo_lab.train.sets import LabelledSet, open_sets
from walltopo_lab.train.yolo_data import write_yolo_set


def _library() -> Any:
    return need_ultralytics("training this model", "train the default: --model votes")


def _make_network(name: str, weights: Path | None) -> Any:
    """Return a network with random weights, or with those of a `.pt` file."""
    library = _library()
    kind = library.RTDETR if name.startswith("rtdetr") else library.YOLO
    if weights is None:
        return kind(f"{name}.yaml")
    if not weights.is_file():
        raise InputError(
            f"{weights}: no such file of pretrained weights",
            "Ultralytics publishes those trained on COCO at "
            f"https://github.com/ultralytics/assets/releases ({name}.pt); put the file there.",
        )
    if weights.name == "last.pt":  # a checkpoint of a run to resume
        return kind(str(weights))
    return kind(f"{name}.yaml").load(str(weights))


def train_arguments(
    settings: YoloSettings, augment: AugmentSettings, data: Path, out: Path
) -> dict[str, Any]:
    """Return Ultralytics' arguments; `crop_fraction` and `degrade` have no counterpart there."""
    device = {} if settings.device == "auto" else {"device": settings.device}
    return {
        "data": str(data),
        "project": str(out.resolve()),
        "name": "ultralytics",
        "exist_ok": True,
        "time": settings.minutes / 60,
        "patience": settings.patience,
        "imgsz": settings.size,
        "batch": settings.batch,
        # With `auto` Ultralytics would choose rate and momentum itself.
        "optimizer": "SGD",
        "lr0": settings.rate,
        "momentum": settings.momentum,
        "seed": settings.seed,
        "workers": 0,
        "max_det": 1000,
        "hsv_h": augment.hue * augment.hue_share,
        "hsv_s": augment.saturation,
        "hsv_v": augment.value,
        "degrees": augment.rotation,
        "translate": augment.translation,
        "scale": min(1.0, max(1 - augment.scale_low, augment.scale_high - 1)),
        "flipud": augment.flip_vertical,
        "fliplr": augment.flip,
        "mosaic": augment.mosaic,
        "verbose": False,
        **device,
    }


def _ap50(metrics: dict[str, Any]) -> float:
    """Return Ultralytics' mAP50, of masks if the network predicts them."""
    for key in ("metrics/mAP50(M)", "metrics/mAP50(B)"):
        if key in metrics:
            return float(metrics[key])
    return 0.0


def _fit_network(
    job: Job, name: str, arguments: dict[str, Any], progress: Progress, on_epoch: OnCheck | None
) -> None:
    """Train or resume; do nothing after a completed training."""
    record = job.out / "history.json"
    known: dict[str, Any] = {"model": name, "seconds": 0.0, "done": False, "epochs": []}
    if record.is_file():
        known = read_json(record)
        if known["model"] != name:
            raise InputError(
                f"{job.out}: holds a run of {known['model']}", "Give another folder with --out."
            )
    if known["done"]:
        return
    last = job.out / "ultralytics" / "weights" / "last.pt"
    network = _make_network(name, last if last.is_file() else job.pretrained)
    begun, before = time.monotonic(), float(known["seconds"])

    def keep_best(trainer: Any) -> None:
        entry = {"epoch": int(trainer.epoch) + 1, "ap50": _ap50(trainer.metrics or {})}
        known["epochs"].append(entry)
        known["seconds"] = before + time.monotonic() - begun
        write_json(record, known)
        progress.detail(f"epoch {entry['epoch']}: AP50 {entry['ap50']:.3f}")
        if on_epoch is not None:
            on_epoch(int(entry["epoch"]), entry["ap50"])

    # `on_model_save` runs once an epoch, after its weights are saved; `on_fit_epoch_end` runs once
    # more at the end.
    network.add_callback("on_model_save", keep_best)
    if last.is_file():
        network.train(resume=True, time=max(1e-4, arguments["time"] - before / 3600))
    else:
        network.train(**arguments)
    write_json(record, known | {"done": True})


def _export_network(job: Job, name: str, settings: YoloSettings) -> Path:
    """Export `holds.onnx` with float16 weights for float32 arithmetic, and return its path."""
    import onnx

    best = job.out / "ultralytics" / "weights" / "best.pt"
    if not best.is_file():
        raise InputError(
            f"{best}: the training left no weights",
            f"Look into {best.parents[1]}, or delete {job.out / 'history.json'} to go on.",
        )
    network = _library().RTDETR(str(best)) if name.startswith("rtdetr") else _library().YOLO(best)
    written = network.export(format="onnx", imgsz=settings.size, simplify=False, opset=17)
    path = job.out / "holds.onnx"
    save_model(onnx.load(written), path)
    set_metadata(path, {"base": name, "preprocessing": "RGB / 255, letterboxed with grey 114"})
    return path


def _checked(sets: list[LabelledSet]) -> list[tuple[Path, str]]:
    for item in sets:
        if item.held_out:
            return [(item.folder, name) for name in item.held_out]
    return [(sets[0].folder, name) for name in sets[0].train]


def train_yolo(
    job: Job,
    name: str,
    settings: YoloSettings,
    augment: AugmentSettings,
    progress: Progress,
    on_epoch: OnCheck | None = None,
) -> dict[str, Any]:
    """Train one of Ultralytics' networks and export it; return the held-out metrics.

    Parameters
    ----------
    job, name, on_epoch : see `fit_yolo`.

    Raises
    ------
    EnvironmentLacksError : the extra is not installed.
    InputError : a data set or the pretrained weights cannot be read.
    """
    sets = fit_yolo(job, name, settings, augment, progress, on_epoch)
    path = _export_network(job, name, settings)
    figures, _ = calibrate(path, _checked(sets), progress)
    counts = [(s.name, len(s.train), len(s.held_out), len(s.dropped)) for s in sets]
    tables = (asdict(settings), asdict(augment))
    card = job.out / "holds.md"
    yolo_card(card, name, job.attribution, job.command, counts, tables, figures)
    return figures


def fit_yolo(
    job: Job,
    name: str,
    settings: YoloSettings,
    augment: AugmentSettings,
    progress: Progress,
    on_epoch: OnCheck | None = None,
) -> list[LabelledSet]:
    """Train, or resume training, one of Ultralytics' networks, without the export.

    Parameters
    ----------
    job : options as for the vote network; `pretrained` is a `.pt` file.
    name : such as `yolo11s-seg`, `yolo11s`, `rtdetr-l`.
    on_epoch : called after each epoch with its number and Ultralytics' mAP50 on held-out photos.
    """
    import torch

    _library()
    torch.set_num_threads(settings.threads)
    sets = open_sets(job.datasets, job.cached, settings.held_out, progress)
    segments = name.endswith("-seg")
    folder = job.cached / ("yolo-outlines" if segments else "yolo-boxes")
    data = write_yolo_set(sets, folder, segments)
    progress.step(f"training {name}", 1)
    _fit_network(job, name, train_arguments(settings, augment, data, job.out), progress, on_epoch)
    progress.advance()
    return sets

"""The training loop: a schedule in minutes, averaged weights, checkpoints that resume."""

from __future__ import annotations

import copy
import math
import pickle
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from walltopo.core import EnvironmentLacksError, InputError, Progress
from walltopo.core.files import atomic_path
from walltopo_lab.train.batches import Batch, batches
from walltopo_lab.train.loss import box_loss, heat_loss, mask_loss
from walltopo_lab.train.net import NetSize, VoteNet, build_net
from walltopo_lab.train.params import AugmentSettings, TrainSettings
from walltopo_lab.train.warm import freeze_norms, load_exported

_SAVE_EVERY = 120.0  # s between checkpoints
Check = Callable[[VoteNet], dict[str, float]]


def learning_rate(done: float, settings: TrainSettings) -> float:
    """The rate after a share `done` of the time: linear warm-up, then a cosine to 1 %."""
    if done < settings.warmup:
        return settings.rate * (0.05 + 0.95 * done / settings.warmup)
    x = min(1.0, (done - settings.warmup) / max(1e-9, 1.0 - settings.warmup))
    return settings.rate * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * x)))


@dataclass
class Run:
    """All that a checkpoint holds."""

    net: VoteNet
    average: VoteNet
    optimiser: torch.optim.Optimizer
    step: int = 0
    seconds: float = 0.0
    best: float = -1.0
    best_state: dict[str, Any] | None = None
    since_best: int = 0
    history: list[dict[str, float]] = field(default_factory=list)
    frozen: bool = False

    def save(self, path: Path) -> None:
        """Write the checkpoint atomically."""
        state = {
            "size": self.net.size.as_dict(),
            "net": self.net.state_dict(),
            "average": self.average.state_dict(),
            "optimiser": self.optimiser.state_dict(),
            "best_state": self.best_state,
        }
        for name in ("step", "seconds", "best", "since_best", "history"):
            state[name] = getattr(self, name)
        with atomic_path(path) as temporary:
            torch.save(state, temporary)


def _optimiser(net: VoteNet, settings: TrainSettings) -> torch.optim.Optimizer:
    decayed = [p for p in net.parameters() if p.ndim > 1]
    plain = [p for p in net.parameters() if p.ndim <= 1]
    groups = [
        {"params": decayed, "weight_decay": settings.weight_decay},
        {"params": plain, "weight_decay": 0.0},
    ]
    return torch.optim.AdamW(groups, lr=settings.rate, betas=(settings.momentum, 0.999))


def _new_run(
    size: NetSize | dict[str, Any] | None, settings: TrainSettings, pretrained: Path | None = None
) -> Run:
    torch.manual_seed(settings.seed)
    net = load_exported(pretrained) if pretrained else build_net(size)
    return Run(net, copy.deepcopy(net), _optimiser(net, settings))


def load_run(path: Path, settings: TrainSettings) -> Run:
    """A run as it was saved.

    Raises
    ------
    InputError : the file is no checkpoint of `walltopo train`.
    """
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
        run = _new_run(state["size"], settings)
        run.net.load_state_dict(state["net"])
        run.average.load_state_dict(state["average"])
        run.optimiser.load_state_dict(state["optimiser"])
        for name in ("step", "seconds", "best", "since_best", "history", "best_state"):
            setattr(run, name, state[name])
    except (KeyError, RuntimeError, OSError, ValueError, EOFError, pickle.UnpicklingError) as error:
        raise InputError(
            f"{path}: not a checkpoint of this program ({error})",
            "Give another folder with --out, or delete the file to start afresh.",
        ) from error
    return run


def _device(settings: TrainSettings) -> torch.device:
    if settings.device == "cuda" and not torch.cuda.is_available():
        raise EnvironmentLacksError(
            "train.device is cuda, but PyTorch sees no GPU", "Use --device cpu."
        )
    wanted = settings.device
    if wanted == "auto":
        wanted = "cuda" if torch.cuda.is_available() else "cpu"
    return torch.device(wanted)


def _losses(net: VoteNet, batch: Batch, device: torch.device) -> dict[str, torch.Tensor]:
    tensors = {name: torch.from_numpy(array).to(device) for name, array in batch.items()}
    photo = tensors["image"].float().to(memory_format=torch.channels_last)
    with torch.autocast(device.type, dtype=torch.bfloat16):
        heat, votes, mask = net(photo)
    return {
        "heat": heat_loss(heat, tensors["heat"], tensors["heat_weight"]),
        "box": box_loss(votes, tensors["votes"], tensors["vote_weight"]),
        "mask": mask_loss(mask, tensors["mask"], tensors["mask_weight"]),
    }


@torch.no_grad()
def _follow(average: VoteNet, net: VoteNet, decay: float) -> None:
    for a, b in zip(average.state_dict().values(), net.state_dict().values(), strict=True):
        if a.dtype.is_floating_point:
            a.lerp_(b, 1.0 - decay)
        else:
            a.copy_(b)


def _update(
    run: Run, batch: Batch, settings: TrainSettings, device: torch.device
) -> dict[str, float]:
    done = run.seconds / (settings.minutes * 60)
    for group in run.optimiser.param_groups:
        group["lr"] = learning_rate(done, settings)
    losses = _losses(run.net, batch, device)
    total = losses["heat"] + 1.5 * losses["box"] + 1.5 * losses["mask"]
    run.optimiser.zero_grad(set_to_none=True)
    total.backward()
    norm = torch.nn.utils.clip_grad_norm_(run.net.parameters(), 5.0)
    if torch.isfinite(norm):
        run.optimiser.step()
    run.step += 1
    # Early on the average must not remember the random start.
    _follow(run.average, run.net, min(settings.ema, (1 + run.step) / (20 + run.step)))
    return {name: float(value.detach()) for name, value in losses.items()}


def _check(run: Run, check: Check, progress: Progress, means: dict[str, float]) -> None:
    run.average.eval()
    figures = check(run.average)
    known = {k: v for k, v in figures.items() if math.isfinite(v)}
    entry = {"step": float(run.step), "minutes": run.seconds / 60, **means, **known}
    run.history.append(entry)
    score = figures["score"]
    if score > run.best:
        run.best, run.since_best = score, 0
        run.best_state = {k: v.detach().cpu().clone() for k, v in run.average.state_dict().items()}
    else:
        run.since_best += 1
    progress.note(f"check: {_told(entry)}")


def train(
    folders: Sequence[tuple[Path, Sequence[str]]],
    shares: Sequence[float],
    checkpoint: Path,
    check: Check,
    settings: TrainSettings,
    augment: AugmentSettings,
    progress: Progress,
    size: NetSize | None = None,
    until: float = 1.0,
    pretrained: Path | None = None,
) -> Run:
    """Train until the time is used up or nothing is gained; resume where `checkpoint` stopped.

    Parameters
    ----------
    folders, shares : see `batches`.
    check : figures of the averaged network on held-out photos; `score` is what is maximised.
    until : stop at this share of the time (the schedule is that of the whole time).
    pretrained : an exported network to start from instead of fresh weights; the statistics of
        its normalisations stay frozen.
    """
    torch.set_num_threads(settings.threads)
    device = _device(settings)
    if checkpoint.is_file():
        run = load_run(checkpoint, settings)
    else:
        run = _new_run(size, settings, pretrained)
    run.frozen = pretrained is not None
    run.net.to(device, memory_format=torch.channels_last)
    run.average.to(device, memory_format=torch.channels_last)
    if run.seconds >= settings.minutes * 60 * until:
        return run
    progress.step("training", round(settings.minutes))
    progress.advance(min(int(run.seconds // 60), round(settings.minutes)))
    supply = batches(folders, shares, settings, augment, settings.seed + run.step)
    try:
        _steps(run, supply, checkpoint, check, settings, device, progress, until)
    except KeyboardInterrupt:
        run.save(checkpoint)
        raise
    return run


def _steps(
    run: Run,
    supply: Iterator[Batch],
    checkpoint: Path,
    check: Check,
    settings: TrainSettings,
    device: torch.device,
    progress: Progress,
    until: float,
) -> None:
    """Steps until `until`, with checks and checkpoints between them."""
    saved = checked = time.monotonic()
    sums: list[dict[str, float]] = []
    minutes = int(run.seconds // 60)
    for batch in supply:
        begin = time.monotonic()
        run.net.train()
        if run.frozen:
            freeze_norms(run.net)
        sums.append(_update(run, batch, settings, device))
        run.seconds += time.monotonic() - begin
        if int(run.seconds // 60) > minutes:
            minutes += 1
            progress.advance()
            told = _told({k: float(np.mean([s[k] for s in sums[-50:]])) for k in sums[-1]})
            progress.detail(f"minute {minutes}, step {run.step}: {told}")
        over = run.seconds >= settings.minutes * 60 * until
        now = time.monotonic()
        if over or now - checked > settings.check_every * 60:
            means = {k: float(np.mean([s[k] for s in sums])) for k in sums[-1]}
            _check(run, check, progress, means)
            sums, checked = [], time.monotonic()
        over = over or run.since_best >= settings.patience
        if over or now - saved > _SAVE_EVERY:
            run.save(checkpoint)
            saved = now
        if over:
            break


def _told(figures: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3f}" for name, value in figures.items())

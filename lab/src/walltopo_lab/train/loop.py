"""The training loop: averaged weights, resumable checkpoints, two schedules.

A run of fixed length lowers its learning rate to almost zero. An endless run keeps its rate; weight
averaging replaces the decay, so that the averaged weights are usable at any time.
"""

from __future__ import annotations

import copy
import itertools
import math
import pickle
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from walltopo.core import EnvironmentLacksError, InputError, Progress
from walltopo.core.files import atomic_path
from walltopo_lab.train.batches import CropSource
from walltopo_lab.train.loss import box_loss, heat_loss, mask_loss
from walltopo_lab.train.net import NetSize, VoteNet, build_net
from walltopo_lab.train.params import TrainSettings
from walltopo_lab.train.precision import fast_autocast
from walltopo_lab.train.supply import TensorBatch, supply
from walltopo_lab.train.warm import freeze_norms, load_exported, measure_norms

_SAVE_EVERY = 120.0  # s between checkpoints
_WARM_STEPS = 200  # steps of linear warm-up of an endless run
_COOL_AVERAGE = 0.98  # decay of the averaged weights in a cool-down
_NORM_BATCHES = 12  # batches for measuring normalisation statistics, if a file has none
Check = Callable[[VoteNet], dict[str, float]]


def learning_rate(done: float, settings: TrainSettings) -> float:
    """Return the rate after a share `done` of the time: linear warm-up, then a cosine to 1 %."""
    if done < settings.warmup:
        return settings.rate * (0.05 + 0.95 * done / settings.warmup)
    x = min(1.0, (done - settings.warmup) / max(1e-9, 1.0 - settings.warmup))
    return settings.rate * (0.01 + 0.99 * 0.5 * (1 + math.cos(math.pi * x)))


def _rate(run: Run, settings: TrainSettings) -> float:
    if settings.is_endless:
        return settings.rate * min(1.0, (1 + run.step - run.first_step) / _WARM_STEPS)
    return learning_rate(run.seconds / (settings.minutes * 60), settings)


def _average_decay(run: Run, settings: TrainSettings) -> float:
    """Return the decay of the averaged weights: a memory of a ninth of the steps, up to a limit.

    A longer memory would retain the start, which is random or was disturbed by a higher rate.
    """
    steps = run.step - run.first_step
    return min(settings.ema, (1 + steps) / (10 + steps))


def cool_down(run: Run, source: CropSource, steps: int, progress: Progress) -> None:
    """Train a loaded run further while its rate falls to zero; the average is the result."""
    settings = source.settings
    torch.set_num_threads(settings.threads)
    device = _device(settings)
    _move_to_device(run, device)
    run.net.train()
    run.average.load_state_dict(run.net.state_dict())
    crops = supply(source, settings.seed + run.step, device)
    progress.step("cool-down", steps)
    for k, batch in enumerate(itertools.islice(crops, steps)):
        _training_step(run, batch, settings.rate * (1 - k / steps), _COOL_AVERAGE, device)
        progress.advance()
    crops.close()


@dataclass
class Run:
    """The state in a checkpoint.

    Parameters
    ----------
    step, first_step : steps so far, and those of the initial network of an endless run.
    seconds : time spent in steps.
    cpu_seconds : processor time of all runs together, including crops and checks, and that of the
        initial network of an endless run.
    history : an entry per check: `step`, `minutes`, `core_hours`, mean losses, held-out metrics.
    frozen : whether the normalisation statistics are frozen.
    """

    net: VoteNet
    average: VoteNet
    optimiser: torch.optim.Optimizer
    step: int = 0
    first_step: int = 0
    seconds: float = 0.0
    cpu_seconds: float = 0.0
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
        for name in _PLAIN:
            state[name] = getattr(self, name)
        with atomic_path(path) as temporary:
            torch.save(state, temporary)


_PLAIN = ("step", "first_step", "seconds", "cpu_seconds", "best", "since_best", "history")


def _make_optimiser(net: VoteNet, settings: TrainSettings) -> torch.optim.Optimizer:
    """Return AdamW with a rate share per group; only weights of several dimensions decay."""
    encoder = {id(p) for p in net.encoder.parameters()}
    groups: list[dict[str, Any]] = []
    for inside, share in ((True, settings.encoder_rate), (False, 1.0)):
        mine = [p for p in net.parameters() if (id(p) in encoder) == inside]
        for decays in (True, False):
            params = [p for p in mine if (p.ndim > 1) == decays]
            decay = settings.weight_decay if decays else 0.0
            groups.append({"params": params, "weight_decay": decay, "share": share})
    return torch.optim.AdamW(groups, lr=settings.rate, betas=(settings.momentum, 0.999))


def _run_of(net: VoteNet, settings: TrainSettings) -> Run:
    return Run(net, copy.deepcopy(net), _make_optimiser(net, settings))


def _begin_run(start: InitialWeights, settings: TrainSettings) -> Run:
    torch.manual_seed(settings.seed)
    if start.pretrained is not None:
        return _run_of(load_exported(start.pretrained), settings)
    return _run_of(build_net(start.size, settings.start == "imagenet"), settings)


def load_run(path: Path, settings: TrainSettings) -> Run:
    """Return a run from its checkpoint.

    Raises
    ------
    InputError : the file is no checkpoint of `walltopo train`.
    """
    try:
        state = torch.load(path, map_location="cpu", weights_only=True)
        torch.manual_seed(settings.seed)
        run = _run_of(build_net(state["size"]), settings)
        run.net.load_state_dict(state["net"])
        run.average.load_state_dict(state["average"])
        run.optimiser.load_state_dict(state["optimiser"])
        for name in (*_PLAIN, "best_state"):
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


def _move_to_device(run: Run, device: torch.device) -> None:
    """Move a run's networks and the optimiser's state to a device."""
    run.net.to(device, memory_format=torch.channels_last)
    run.average.to(device, memory_format=torch.channels_last)
    for group in run.optimiser.param_groups:
        group["fused"] = device.type == "cuda"
    # Loading moves each state to the device of its weights.
    run.optimiser.load_state_dict(run.optimiser.state_dict())


def _losses(net: VoteNet, batch: TensorBatch, device: torch.device) -> dict[str, torch.Tensor]:
    with fast_autocast(device):
        heat, votes, mask = net(batch["image"])
    return {
        "heat": heat_loss(heat, batch["heat"], batch["heat_weight"]),
        "box": box_loss(votes, batch["votes"], batch["vote_weight"]),
        "mask": mask_loss(mask, batch["mask"], batch["mask_weight"]),
    }


@torch.no_grad()
def _follow(average: VoteNet, net: VoteNet, decay: float) -> None:
    for a, b in zip(average.state_dict().values(), net.state_dict().values(), strict=True):
        if a.dtype.is_floating_point:
            a.lerp_(b, 1.0 - decay)
        else:
            a.copy_(b)


def _training_step(
    run: Run, batch: TensorBatch, rate: float, ema: float, device: torch.device
) -> dict[str, float]:
    """Run one training step and return its losses."""
    for group in run.optimiser.param_groups:
        group["lr"] = rate * group["share"]
    losses = _losses(run.net, batch, device)
    total = losses["heat"] + 1.5 * losses["box"] + 1.5 * losses["mask"]
    run.optimiser.zero_grad(set_to_none=True)
    total.backward()
    norm = torch.nn.utils.clip_grad_norm_(run.net.parameters(), 5.0)
    if torch.isfinite(norm):
        run.optimiser.step()
    run.step += 1
    _follow(run.average, run.net, ema)
    return {name: float(value.detach()) for name, value in losses.items()}


def _check(run: Run, check: Check, progress: Progress, means: dict[str, float]) -> None:
    run.average.eval()
    figures = check(run.average)
    known = {k: v for k, v in figures.items() if math.isfinite(v)}
    clock = {"minutes": run.seconds / 60, "core_hours": run.cpu_seconds / 3600}
    entry = {"step": float(run.step), **clock, **means, **known}
    run.history.append(entry)
    score = figures["score"]
    if score > run.best:
        run.best, run.since_best = score, 0
        run.best_state = {k: v.detach().cpu().clone() for k, v in run.average.state_dict().items()}
    else:
        run.since_best += 1
    progress.note(f"check: {_losses_line(entry)}")


@dataclass(frozen=True)
class InitialWeights:
    """The initial weights of a run.

    Parameters
    ----------
    size : of a new network; None: the default.
    pretrained : an exported network instead of a new one. An endless run measures the statistics
        of its normalisations; otherwise they stay frozen.
    steps, cpu_seconds : what was spent on `pretrained` before.
    """

    size: NetSize | None = None
    pretrained: Path | None = None
    steps: int = 0
    cpu_seconds: float = 0.0


def train(
    source: CropSource,
    start: InitialWeights,
    checkpoint: Path,
    check: Check,
    progress: Progress,
    until: float = 1.0,
    report: Callable[[Run], None] = lambda _: None,
) -> Run:
    """Train until the time is up or the score stalls; resume from `checkpoint` if it exists.

    Parameters
    ----------
    check : metrics of the averaged network on held-out photos; `score` is the objective.
    until : stop at this share of the time (the schedule still spans the whole time).
    report : called after each check, and once at the start.
    """
    settings = source.settings
    torch.set_num_threads(settings.threads)
    device = _device(settings)
    begun = checkpoint.is_file()
    run = load_run(checkpoint, settings) if begun else _begin_run(start, settings)
    if not settings.encoder_rate:
        run.net.encoder.requires_grad_(False)
    run.frozen = start.pretrained is not None and not settings.is_endless
    crops = supply(source, settings.seed + run.step, device)
    if settings.is_endless and start.pretrained is not None and not begun:
        photos = itertools.islice(crops, _NORM_BATCHES)
        measure_norms(run.net, (batch["image"].cpu() for batch in photos))
        run.average.load_state_dict(run.net.state_dict())
        run.step = run.first_step = start.steps
        run.cpu_seconds = start.cpu_seconds
    _move_to_device(run, device)
    if not settings.is_endless and run.seconds >= settings.minutes * 60 * until:
        return run
    progress.step("training", None if settings.is_endless else round(settings.minutes))
    progress.advance(min(int(run.seconds // 60), round(settings.minutes)))
    leg = _Leg(run, checkpoint, check, settings, progress, report)
    try:
        leg.steps(crops, device, until)
    except KeyboardInterrupt:
        run.save(checkpoint)
        raise
    finally:
        crops.close()
    return run


@dataclass
class _Leg:
    """A span of training from a start or checkpoint, with checks and checkpoints."""

    run: Run
    checkpoint: Path
    do_check: Check
    settings: TrainSettings
    progress: Progress
    report: Callable[[Run], None]
    sums: list[dict[str, float]] = field(default_factory=list)

    def means(self, last: int = 0) -> dict[str, float]:
        """Return mean losses since the last check, or of the last steps only."""
        if not self.sums:
            return {}
        return {k: float(np.mean([s[k] for s in self.sums[-last:]])) for k in self.sums[-1]}

    def check(self) -> None:
        """Append held-out metrics to the history and save a checkpoint."""
        _check(self.run, self.do_check, self.progress, self.means())
        self.sums = []
        self.run.save(self.checkpoint)
        self.report(self.run)

    def check_is_due(self) -> bool:
        """Return whether a check is due, by time spent in steps, which restarts do not reset."""
        last = self.run.history[-1]["minutes"] if self.run.history else 0.0
        return self.run.seconds / 60 - last > self.settings.check_every

    def report_minute(self, minute: int) -> None:
        """Report a line on training progress."""
        self.progress.advance()
        losses_text = _losses_line(self.means(50))
        self.progress.detail(f"minute {minute}, step {self.run.step}: {losses_text}")

    def steps(self, crops: Iterator[TensorBatch], device: torch.device, until: float) -> None:
        """Train until `until`, or until the score stalls."""
        run, settings = self.run, self.settings
        if settings.is_endless and not run.history:
            self.check()
        self.report(run)
        saved = time.monotonic()
        spent = time.process_time()
        for batch in crops:
            begin, minutes = time.monotonic(), int(run.seconds // 60)
            run.net.train()
            if run.frozen:
                freeze_norms(run.net)
            if not settings.encoder_rate:
                run.net.encoder.eval()
            ema = _average_decay(run, settings)
            self.sums.append(_training_step(run, batch, _rate(run, settings), ema, device))
            now = time.monotonic()
            run.seconds += now - begin
            run.cpu_seconds, spent = (
                run.cpu_seconds + time.process_time() - spent,
                time.process_time(),
            )
            if int(run.seconds // 60) > minutes:
                self.report_minute(minutes + 1)
            over = not settings.is_endless and run.seconds >= settings.minutes * 60 * until
            if over or self.check_is_due():
                self.check()
                saved = time.monotonic()
            over = over or (not settings.is_endless and run.since_best >= settings.patience)
            if over or now - saved > _SAVE_EVERY:
                run.save(self.checkpoint)
                saved = now
            if over:
                break


def _losses_line(figures: dict[str, float]) -> str:
    return ", ".join(f"{name} {value:.3f}" for name, value in figures.items())

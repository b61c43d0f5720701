"""Search of a detector's training hyperparameters by successive halving.

After each rung only the best third of the trials continues (Li et al., "A System for
Massively Parallel Hyperparameter Tuning", MLSys 2020, as Optuna's SuccessiveHalvingPruner). The
objective is AP50 on held-out photos.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from walltopo.core import InputError, Progress
from walltopo_lab.extras import need_optuna
from walltopo_lab.train.params import AUGMENTS, AugmentSettings, TrainSettings, YoloSettings

FAMILIES = ("votes", "yolo11-seg", "yolo11", "rtdetr")
REDUCTION = 3  # one of three trials continues after a rung
CHECKS = 9  # validations of a vote network in one trial: rungs after 1, 3 and 9

# The published search space. The vote network trains on crops, so `size` is the crop's side.
RATE, MOMENTUM = (1e-4, 1e-1), (0.5, 0.99)
BATCHES = (2, 4, 8, 16, 32)
SIZES = {"votes": (256, 384, 480, 640)}
SCALES = {"rtdetr": ("l", "x"), "votes": ("lite0", "lite1", "lite2")}


@dataclass(frozen=True)
class DetectorSearch:
    """The search space.

    Parameters
    ----------
    family : one of `FAMILIES`.
    datasets : labelled sets, as for `walltopo train`.
    out : folder of the search, with a folder per trial and one shared photo cache.
    minutes : duration of a trial that is not pruned.
    augment : augmentation, the same for all trials.
    held_out, threads, device : as in training.
    pretrained : folder with Ultralytics' weights by name (`yolo11s-seg.pt`), or None.
    """

    family: str
    datasets: tuple[Path, ...]
    out: Path
    minutes: float
    augment: AugmentSettings = AUGMENTS["default"]
    held_out: float = 0.08
    threads: int = 1
    device: str = "auto"
    pretrained: Path | None = None

    def __post_init__(self) -> None:
        if self.family not in FAMILIES:
            raise InputError(
                f"unknown family {self.family!r}; expected one of {', '.join(FAMILIES)}"
            )

    def space(self) -> dict[str, Any]:
        """Return the search space that a stored study must match."""
        return {
            "family": self.family,
            "rate": list(RATE),
            "momentum": list(MOMENTUM),
            "batch": list(BATCHES),
            "size": list(SIZES.get(self.family, (640, 960, 1024, 1280))),
            "network": list(SCALES.get(self.family, ("n", "s", "m", "l", "x"))),
            "minutes": self.minutes,
        }


@dataclass(frozen=True)
class SearchTrial:
    """One finished trial: AP50 by rung step, and whether it was pruned."""

    number: int
    values: dict[str, Any]
    steps: dict[int, float]
    stopped: bool

    @property
    def best(self) -> float:
        return max(self.steps.values(), default=0.0)


def open_search(search: DetectorSearch, storage: str, name: str, seed: int) -> Any:
    """Open or create the Optuna study of a search.

    Raises
    ------
    InputError : the database cannot be opened, or the study has another search space.
    """
    optuna = need_optuna()
    try:
        study = optuna.create_study(
            storage=storage,
            study_name=name,
            direction="maximize",
            sampler=optuna.samplers.TPESampler(seed=seed),
            pruner=optuna.pruners.SuccessiveHalvingPruner(
                min_resource=1, reduction_factor=REDUCTION
            ),
            load_if_exists=True,
        )
    except Exception as error:  # each database driver raises its own exception types
        raise InputError(f"the study's storage cannot be opened ({error})") from error
    before = study.user_attrs.get("space")
    if before is not None and before != search.space():
        raise InputError(
            f"study {name!r} searches something else ({before})",
            "Give another --study name, or another --storage.",
        )
    study.set_user_attr("space", search.space())
    return study


def sample_point(trial: Any, space: Mapping[str, Any]) -> dict[str, Any]:
    """Sample one point of the search space."""
    return {
        "rate": trial.suggest_float("rate", *space["rate"], log=True),
        "momentum": trial.suggest_float("momentum", *space["momentum"]),
        "batch": trial.suggest_categorical("batch", space["batch"]),
        "size": trial.suggest_categorical("size", space["size"]),
        "network": trial.suggest_categorical("network", space["network"]),
    }


def model_name(family: str, network: str) -> str:
    """Return Ultralytics' name of a family's network: `yolo11s-seg`, `rtdetr-l`."""
    if family == "rtdetr":
        return f"rtdetr-{network}"
    return f"yolo11{network}" + ("-seg" if family.endswith("-seg") else "")


def _train_trial(
    search: DetectorSearch,
    values: Mapping[str, Any],
    folder: Path,
    seen: Callable[[int, float], None],
    progress: Progress,
) -> None:
    """Train one trial; `seen` receives AP50 after each rung and may stop the trial."""
    from walltopo_lab.train.detector import Job, fit_detector
    from walltopo_lab.train.yolo import fit_yolo

    job = Job(search.datasets, folder, cache=search.out / "cache")
    common = {
        "minutes": search.minutes,
        "rate": values["rate"],
        "momentum": values["momentum"],
        "batch": values["batch"],
        "held_out": search.held_out,
        "threads": search.threads,
        "device": search.device,
        "patience": 1_000_000,  # the pruner alone stops trials early
    }
    if search.family == "votes":
        settings = TrainSettings(
            crop=values["size"],
            network=values["network"],
            audit=0.0,
            check_every=search.minutes / CHECKS,
            **common,
        )
        fit_detector(job, settings, search.augment, progress, seen)
        return
    name = model_name(search.family, values["network"])
    if search.pretrained is not None:
        job = replace(job, pretrained=search.pretrained / f"{name}.pt")
    fit_yolo(job, name, YoloSettings(size=values["size"], **common), search.augment, progress, seen)


def run_search(study: Any, search: DetectorSearch, trials: int, progress: Progress) -> None:
    """Run trials until the study has this many that were completed or pruned."""
    optuna = need_optuna()
    states = (optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED)
    have = len(study.get_trials(deepcopy=False, states=states))
    progress.step("trials", max(0, trials - have))

    def objective(trial: Any) -> float:
        best = 0.0

        def seen(step: int, value: float) -> None:
            nonlocal best
            best = max(best, value)
            trial.report(value, step)
            if trial.should_prune():
                raise optuna.TrialPruned

        values = sample_point(trial, search.space())
        progress.detail(f"trial {trial.number}: {values}")
        _train_trial(search, values, search.out / f"trial-{trial.number}", seen, progress)
        return best

    def report_trial(_study: Any, trial: Any) -> None:
        progress.advance()
        progress.note(f"trial {trial.number}: {trial.state.name.lower()}, AP50 {trial.value}")

    if have < trials:
        stop = optuna.study.MaxTrialsCallback(trials, states=states)
        study.optimize(objective, callbacks=[report_trial, stop])


def trials_of(study: Any) -> Sequence[SearchTrial]:
    """Return all completed or pruned trials in order."""
    optuna = need_optuna()
    states = (optuna.trial.TrialState.COMPLETE, optuna.trial.TrialState.PRUNED)
    return [
        SearchTrial(
            t.number,
            dict(t.params),
            {int(k): float(v) for k, v in sorted(t.intermediate_values.items())},
            t.state == optuna.trial.TrialState.PRUNED,
        )
        for t in study.get_trials(deepcopy=False, states=states)
    ]

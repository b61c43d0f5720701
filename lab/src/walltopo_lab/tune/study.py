"""The search: resumable, parallel Bayesian optimisation with a Gaussian process."""

from __future__ import annotations

import os
import re
import socket
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from walltopo.core import InputError, Progress, SettingsError, Silent
from walltopo_lab.extras import need_optuna
from walltopo_lab.tune.task import Task

# Random trials before the Gaussian process takes over, including the default.
STARTUP = 10
MAX_ATTEMPTS = 6


@dataclass(frozen=True)
class Trial:
    """One evaluated point of the search space."""

    number: int
    values: dict[str, float]
    figure: float
    walls: dict[str, float]
    seconds: float


@dataclass(frozen=True)
class Found:
    """The result of a search.

    Parameters
    ----------
    best : the trial with the highest mean metric; the earliest one in case of a tie.
    default : the trial of the current defaults.
    trials : all complete trials, in order.
    importance : share of the metric's variance that each setting explains (fANOVA), largest first.
    """

    best: Trial
    default: Trial
    trials: tuple[Trial, ...]
    importance: dict[str, float]


def open_study(
    task: Task, storage: str, name: str, seed: int, walls: Mapping[str, str] | None = None
) -> Any:
    """Open or create a study.

    Parameters
    ----------
    storage : a database URL (`sqlite:///file.db`, `postgresql+pg8000://...`): workers on one or
        many machines share it, and a later run resumes it.
    walls : the tuning walls, name to content hash (see `walls.wall_hashes`). A study resumed with
        other walls could report on walls that its first trials were tuned on.

    Raises
    ------
    InputError : the study exists for other settings or other walls.
    """
    import warnings

    optuna = need_optuna()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # GPSampler is marked experimental
        sampler = optuna.samplers.GPSampler(seed=seed, n_startup_trials=STARTUP)
        study = _open_study(optuna, storage, name, sampler)
    mine = {r.name: [r.low, r.high, r.curve] for r in task.ranges}
    mine_text = {
        "ranges": mine,
        "figure": task.figure,
        "fixed": dict(task.fixed),
        "walls": dict(walls or {}),
    }
    before = study.user_attrs.get("problem")
    if before is not None and before != mine_text:
        raise InputError(
            f"{_without_password(storage)}: study {name!r} searches something else ({before})",
            "Give another --study name, or another --storage.",
        )
    if before is None:
        study.set_user_attr("problem", mine_text)
        # The first trial has the current defaults, so that the result is never worse than they are.
        study.enqueue_trial({r.name: r.share(r.default) for r in task.ranges})
    return study


def _open_study(optuna: Any, storage: str, name: str, sampler: Any) -> Any:
    """Open or create a study; retries when several workers create its tables at the same time."""
    attempts = 0
    while True:
        try:
            return optuna.create_study(
                storage=storage,
                study_name=name,
                sampler=sampler,
                direction="maximize",
                load_if_exists=True,
            )
        except Exception as error:  # each database driver raises its own exception types
            attempts += 1
            # Another worker is creating the tables; they exist at the next attempt.
            if "already exists" not in str(error) or attempts == MAX_ATTEMPTS:
                raise InputError(
                    f"{_without_password(storage)}: cannot be opened ({error})",
                    "PostgreSQL needs a driver: pip install pg8000, and a URL such as "
                    "postgresql+pg8000://user:password@host/database.",
                ) from error
        time.sleep(0.5 * attempts)


def _without_password(storage: str) -> str:
    return re.sub(r"(://[^:/@]*):[^@]*@", r"\1:***@", storage)


def _objective(task: Task) -> Callable[[Any], float]:
    worker = f"{socket.gethostname()}:{os.getpid()}"

    def evaluate(trial: Any) -> float:
        values = {r.name: r.value(trial.suggest_float(r.name, 0.0, 1.0)) for r in task.ranges}
        try:
            walls = task.evaluate(values)
        except SettingsError:
            # Incompatible values score 0, so that the search avoids them.
            trial.set_user_attr("impossible", True)
            return 0.0
        trial.set_user_attr("walls", walls)
        trial.set_user_attr("worker", worker)
        return float(np.mean(list(walls.values())))

    return evaluate


def run_trials(study: Any, task: Task, trials: int, progress: Progress | None = None) -> None:
    """Run trials until the study has this many complete ones, including those of other workers."""
    optuna = need_optuna()
    listener = progress or Silent()
    done = (optuna.trial.TrialState.COMPLETE,)
    have = len(study.get_trials(deepcopy=False, states=done))
    listener.step("trials", max(0, trials - have))
    if have >= trials:
        return

    def tell(study: Any, trial: Any) -> None:
        listener.advance()
        value = "-" if trial.value is None else f"{trial.value:.4f}"
        listener.detail(f"trial {trial.number}: {value} {trial.params}")

    stop = optuna.study.MaxTrialsCallback(trials, states=done)
    study.optimize(_objective(task), callbacks=[stop, tell])


def study_results(study: Any, task: Task, seed: int = 0) -> Found:
    """Return the best trial, the default's, and the importance of each setting.

    Raises
    ------
    InputError : no trial is complete.
    """
    optuna = need_optuna()
    done = study.get_trials(deepcopy=False, states=(optuna.trial.TrialState.COMPLETE,))
    trials = tuple(
        Trial(
            t.number,
            {r.name: r.value(t.params[r.name]) for r in task.ranges},
            float(t.value),
            dict(t.user_attrs.get("walls", {})),
            t.duration.total_seconds() if t.duration else 0.0,
        )
        for t in sorted(done, key=lambda t: t.number)
    )
    real = [t for t in trials if t.walls]
    if not real:
        raise InputError("no trial of the study is complete")
    best = max(real, key=lambda t: (t.figure, -t.number))
    defaults = {r.name: r.default for r in task.ranges}
    same = (t for t in real if all(abs(t.values[k] - v) < 1e-9 for k, v in defaults.items()))
    default = next(same, None)
    if default is None:
        walls = task.evaluate(defaults)
        default = Trial(-1, defaults, float(np.mean(list(walls.values()))), walls, 0.0)
    importance: dict[str, float] = {}
    if len(trials) >= STARTUP and len({t.figure for t in trials}) > 1:
        evaluator = optuna.importance.FanovaImportanceEvaluator(seed=seed)
        importance = dict(optuna.importance.get_param_importances(study, evaluator=evaluator))
    return Found(best, default, trials, {k: float(v) for k, v in importance.items()})

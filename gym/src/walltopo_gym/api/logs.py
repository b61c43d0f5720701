"""What the server says to its operator: lines on stderr, which nobody has to read along."""

from __future__ import annotations

import copy
from typing import Any

from uvicorn.config import LOGGING_CONFIG

__all__ = ["log_config"]


def log_config() -> dict[str, Any]:
    """uvicorn's own, all of it on stderr, with the platform's lines among them."""
    config: dict[str, Any] = copy.deepcopy(LOGGING_CONFIG)
    config["handlers"]["access"]["stream"] = "ext://sys.stderr"
    config["loggers"]["walltopo_gym"] = {
        "handlers": ["default"],
        "level": "INFO",
        "propagate": False,
    }
    return config

"""What the server says to its operator: lines on stderr, which nobody has to read along.

`log = "json"`: one object a line, for a program that gathers logs.
"""

from __future__ import annotations

import logging
from typing import Any, Literal

from walltopo_gym.api.observed import REQUEST


class _WithRequest(logging.Filter):
    """Lets each line bear the id of the request during which it was written."""

    def filter(self, record: logging.LogRecord) -> bool:
        record.request = REQUEST.get()
        return True


def log_config(kind: Literal["plain", "json"]) -> dict[str, Any]:
    """For `logging.config.dictConfig`, and for uvicorn; its own access log is not used."""
    plain = {"format": "%(asctime)s %(levelname)s %(name)s %(message)s %(request)s"}
    objects = {
        "()": "pythonjsonlogger.json.JsonFormatter",
        "format": "%(asctime)s %(levelname)s %(name)s %(message)s %(request)s",
        "rename_fields": {"asctime": "at", "levelname": "level", "name": "logger"},
    }
    own = {"handlers": ["stderr"], "level": "INFO", "propagate": False}
    return {
        "version": 1,
        "disable_existing_loggers": False,
        "filters": {"request": {"()": _WithRequest}},
        "formatters": {"lines": plain if kind == "plain" else objects},
        "handlers": {
            "stderr": {
                "class": "logging.StreamHandler",
                "stream": "ext://sys.stderr",
                "formatter": "lines",
                "filters": ["request"],
            }
        },
        "loggers": {"walltopo_gym": own, "uvicorn": own},
    }

"""Holds this process at one place, so that a test can stop or kill it there (see `hold.py`).

Python imports this module when it starts, if its folder is on PYTHONPATH. `WALLTOPO_TEST_HOLD`
names the place: `stage:NAME` is the beginning of a stage, `rename` the moment before a finished
result gets its name. The process writes the file `WALLTOPO_TEST_HELD` when it is there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def _held(*_: Any) -> None:
    Path(os.environ["WALLTOPO_TEST_HELD"]).touch()
    while True:
        time.sleep(0.05)


def _before_results(move: Callable[..., None]) -> Callable[..., None]:
    def moved(source: Any, *rest: Any, **more: Any) -> None:
        if ".partial-" in str(source):
            _held()
        move(source, *rest, **more)

    return moved


_place = os.environ.get("WALLTOPO_TEST_HOLD", "")
if _place == "rename":
    os.replace, os.rename = _before_results(os.replace), _before_results(os.rename)
elif _place.startswith("stage:"):
    from walltopo.pipeline.stages import stage_named

    object.__setattr__(stage_named(_place.partition(":")[2]), "run", _held)

"""Stops this process at one place, so that a test can end or kill it there (see `breakpoint.py`).

Python imports this module when it starts, if its folder is on PYTHONPATH.
`WALLTOPO_TEST_BREAKPOINT` names the place: `stage:NAME` is the beginning of a stage, `first:NAME`
the same for the first of several processes alone, `rename` the moment before a finished result gets
its name. The process writes its number into the file `WALLTOPO_TEST_REACHED` when it is there.
"""

from __future__ import annotations

import os
import time
from collections.abc import Callable
from functools import wraps
from pathlib import Path
from typing import Any


def _is_first() -> bool:
    """Write the mark, whole at once; return whether no other process wrote it before."""
    mark, number = Path(os.environ["WALLTOPO_TEST_REACHED"]), str(os.getpid())
    own = mark.with_name(f"{mark.name}-{number}")
    own.write_text(number)
    try:
        os.link(own, mark)
    except FileExistsError:
        return False
    finally:
        own.unlink()
    return True


def _stop(*_: Any) -> None:
    _is_first()
    while True:
        time.sleep(0.05)


def _stop_first(run: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(run)
    def begun(*given: Any, **named: Any) -> Any:
        if _is_first():
            _stop()
        return run(*given, **named)

    return begun


def _before_results(move: Callable[..., None]) -> Callable[..., None]:
    def moved(source: Any, *rest: Any, **more: Any) -> None:
        if ".partial-" in str(source):
            _stop()
        move(source, *rest, **more)

    return moved


_place = os.environ.get("WALLTOPO_TEST_BREAKPOINT", "")
if _place == "rename":
    os.replace, os.rename = _before_results(os.replace), _before_results(os.rename)
elif _place.startswith(("stage:", "first:")):
    from walltopo.pipeline.stages import stage_named

    _stage = stage_named(_place.partition(":")[2])
    _run = _stop if _place.startswith("stage:") else _stop_first(_stage.run)
    object.__setattr__(_stage, "run", _run)

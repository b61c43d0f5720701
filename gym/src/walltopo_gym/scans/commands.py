"""Run a command of `walltopo` at the lowest priority, with a limit on its time."""

from __future__ import annotations

import logging
import subprocess
import threading
import time
from collections.abc import Sequence
from typing import Final

from walltopo.core.children import Child, child_process, describe_exit, python_module
from walltopo_gym.errors import without_folders
from walltopo_gym.log_lines import OWN_LINES
from walltopo_gym.scans.running import WorkerStopsError

_LOG = logging.getLogger("walltopo_gym.scans")
_LOOK_S: Final = 1.0
_MAX_ERROR: Final = 500


def run_command(words: Sequence[str], seconds: float, stopping: threading.Event) -> str:
    """Run a command of `walltopo` and return why it failed, empty on success.

    Parameters
    ----------
    words : of the command, without the program's name.
    seconds : after which it is killed. stopping : set when the worker stops.

    Raises
    ------
    WorkerStopsError : the worker stops; the job begins again with the next one.
    """
    command = python_module("walltopo_gym.scans.low_priority", *words)
    limit = time.monotonic() + seconds
    lines: list[str] = []
    with child_process(command, errors=subprocess.STDOUT) as child:
        reader = threading.Thread(target=lambda: lines.extend(_output_lines(child)), daemon=True)
        reader.start()
        while reader.is_alive():
            reader.join(_LOOK_S)
            if stopping.is_set():
                raise WorkerStopsError
            if time.monotonic() > limit:
                return f"`walltopo {words[0]}` took longer than {seconds / 60:.0f} minutes"
        code = child.wait()
    if code == 0:
        return ""
    exit_code = describe_exit(code)
    last = "\n".join(lines[-20:])
    _LOG.warning("walltopo %s: %s\n%s", words[0], exit_code, last, extra=OWN_LINES)
    first = next((line for line in lines if line.startswith("error: ")), exit_code)
    return without_folders(first.removeprefix("error: "))[:_MAX_ERROR]


def _output_lines(child: Child) -> list[str]:
    return child.output.read().decode(errors="replace").splitlines()

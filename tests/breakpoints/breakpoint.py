"""Stop a child process at one place of its code."""

from __future__ import annotations

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any

PATIENCE_S = 1800  # a stage may come after a whole scan on a loaded machine


@dataclass(frozen=True)
class Breakpoint:
    """Stops a child process at one place, so that a test can end or kill it there."""

    mark: Path

    def at(self, place: str) -> dict[str, str]:
        """Return the environment of a child that stops at `stage:NAME`, `first:NAME` or `rename`.

        See `sitecustomize.py` beside this file.
        """
        self.mark.unlink(missing_ok=True)
        paths = [str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
        return os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "WALLTOPO_TEST_BREAKPOINT": place,
            "WALLTOPO_TEST_REACHED": str(self.mark),
        }

    def wait(self, process: subprocess.Popen[Any] | None = None) -> int:
        """Wait until the child, or one of its own, is at the place, and return the number of the
        process that is there; fail if the child ends before.

        Parameters
        ----------
        process : the child; None if a program that runs already starts it.
        """
        deadline = time.monotonic() + PATIENCE_S
        while not self.mark.exists():
            ended = process is not None and process.poll() is not None
            assert not ended, "the process ended before it came to the place"
            assert time.monotonic() < deadline, f"not at the place within {PATIENCE_S} s"
            time.sleep(0.01)
        return int(self.mark.read_text())

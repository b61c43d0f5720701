"""How a test holds a child process at one place."""

from __future__ import annotations

import os
import subprocess
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Hold:
    """Holds a child process at one place, so that a test can stop or kill it there."""

    mark: Path

    def at(self, place: str) -> dict[str, str]:
        """Return the environment of a child that stops at `stage:NAME` or at `rename`.

        See `sitecustomize.py` beside this file.
        """
        self.mark.unlink(missing_ok=True)
        paths = [str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
        return os.environ | {
            "PYTHONPATH": os.pathsep.join(paths),
            "WALLTOPO_TEST_HOLD": place,
            "WALLTOPO_TEST_HELD": str(self.mark),
        }

    def wait(self, process: subprocess.Popen[Any]) -> None:
        """Wait until the child is at the place; fail if it ends before."""
        while not self.mark.exists():
            assert process.poll() is None, "the process ended before it came to the place"
            time.sleep(0.01)
